#include "client_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

#include "problem.hpp"

namespace meshsmooth::gateway {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kGrace{5};  // between a request to end and the end by force
constexpr std::size_t kLongestLine = 65536;

std::vector<char*> pointers_to(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

/// In the child, where only calls that are safe after a fork may be made.
[[noreturn]] void become_client(const ClientCall& call, char* const* arguments,
                                char* const* environment, int error_pipe, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);  // it died before
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  const rlimit core{0, 0};
  ::setrlimit(RLIMIT_CORE, &core);
  if (call.max_bytes != 0) {
    const rlimit memory{call.max_bytes, call.max_bytes};
    ::setrlimit(RLIMIT_AS, &memory);
  }
  const bool ready = ::chdir(call.folder.c_str()) == 0;
  const int input = ::open("/dev/null", O_RDONLY);
  const int output = ::open(kPrintedFile, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (ready && input >= 0 && output >= 0 && ::dup2(input, STDIN_FILENO) >= 0 &&
      ::dup2(output, STDOUT_FILENO) >= 0 && ::dup2(error_pipe, STDERR_FILENO) >= 0) {
    ::close_range(STDERR_FILENO + 1, ~0U, 0);  // connections that the HTTP library leaves open
    ::execve(arguments[0], arguments, environment);
  }
  ::_exit(127);
}

/// What of the gateway's environment the client gets: no tokens, no flags.
std::vector<std::string> environment_of(const ClientCall& call) {
  std::vector<std::string> environment = {"TMPDIR=" + call.folder.string()};
  for (char** variable = environ; *variable != nullptr; ++variable) {
    for (const char* name : {"PATH=", "LD_LIBRARY_PATH=", "LANG=", "LC_ALL=", "ASAN_OPTIONS=",
                             "TSAN_OPTIONS=", "GRPC_DNS_RESOLVER="}) {
      if (std::string_view(*variable).starts_with(name)) environment.emplace_back(*variable);
    }
  }
  if (!call.traceparent.empty()) environment.push_back("TRACEPARENT=" + call.traceparent);
  return environment;
}

/// The lines of the client's error output.
class Messages {
 public:
  Messages(CallResult& result, const std::function<void(const nlohmann::json&)>& on_progress)
      : result_(result), on_progress_(on_progress) {}

  void add(std::string_view bytes) {
    text_ += bytes;
    std::size_t end = 0;
    while ((end = text_.find('\n')) != std::string::npos) {
      take(text_.substr(0, end));
      text_.erase(0, end + 1);
    }
    if (text_.size() > kLongestLine) text_.clear();
  }

 private:
  void take(std::string line) {
    const auto object = nlohmann::json::parse(line, nullptr, false);
    if (object.is_object() && object.contains("progress")) {
      on_progress_(object.at("progress"));
    } else {
      result_.error = std::move(line);
    }
  }

  CallResult& result_;
  const std::function<void(const nlohmann::json&)>& on_progress_;
  std::string text_;
};

/// What of `fds` besides the first says that the call is to end.
CallEnd cause_of(const std::array<pollfd, 4>& fds) {
  if ((fds[1].revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0) return CallEnd::peer_gone;
  if (fds[2].revents != 0) return CallEnd::cancelled;
  if (fds[3].revents != 0) return CallEnd::draining;
  return CallEnd::exited;
}

/// Reads messages until the client has closed its error output, which it does at its end.
void follow(pid_t client, int error_pipe, const ClientCall& call,
            const Interruptions& interruptions, CallResult& result, Messages& messages) {
  const auto of = [](const Stop* stop) { return stop == nullptr ? -1 : stop->descriptor(); };
  std::array<pollfd, 4> fds = {
      pollfd{error_pipe, POLLIN, 0}, pollfd{interruptions.peer, POLLRDHUP, 0},
      pollfd{of(interruptions.cancel), POLLIN, 0}, pollfd{of(interruptions.drain), POLLIN, 0}};
  Clock::time_point deadline = call.deadline;
  std::array<char, 4096> buffer{};
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    const int ready =
        ::poll(fds.data(), fds.size(), static_cast<int>(std::clamp<long>(left.count(), 0, 60000)));
    if (ready < 0 && errno != EINTR) break;
    if (ready > 0 && fds[0].revents != 0) {
      const ssize_t count = ::read(error_pipe, buffer.data(), buffer.size());
      if (count > 0) messages.add({buffer.data(), static_cast<std::size_t>(count)});
      if (count == 0 || (count < 0 && errno != EINTR)) return;
      continue;
    }
    const bool late = Clock::now() >= deadline;
    const CallEnd cause = ready > 0 ? cause_of(fds) : CallEnd::exited;
    if (!late && cause == CallEnd::exited) continue;
    if (result.end != CallEnd::exited) {
      ::kill(client, SIGKILL);
      deadline = Clock::time_point::max() - std::chrono::hours(1);
    } else {
      result.end = cause == CallEnd::exited ? CallEnd::deadline : cause;
      ::kill(client, SIGTERM);
      deadline = Clock::now() + kGrace;
    }
    for (std::size_t n = 1; n < fds.size(); ++n) fds[n].fd = -1;  // one reason is enough
  }
}

}  // namespace

Stop::Stop() : descriptor_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (descriptor_ < 0) throw Problem("INTERNAL", "no descriptors are left");
}
Stop::~Stop() { ::close(descriptor_); }
void Stop::request() noexcept {
  const std::uint64_t one = 1;
  // It fails only where it was requested 2^64 - 2 times.
  [[maybe_unused]] const ssize_t written = ::write(descriptor_, &one, sizeof one);
}
bool Stop::requested() const noexcept {
  pollfd fd{descriptor_, POLLIN, 0};
  return ::poll(&fd, 1, 0) == 1;
}

bool is_gone(int peer) {
  pollfd fd{peer, POLLRDHUP, 0};
  return peer >= 0 && ::poll(&fd, 1, 0) == 1;
}

CallResult run_client(const ClientCall& call, const Interruptions& interruptions,
                      const std::function<void(const nlohmann::json&)>& on_progress) {
  std::vector<std::string> arguments = call.arguments;
  arguments.insert(arguments.begin(), call.program.string());
  std::vector<std::string> environment = environment_of(call);
  const std::vector<char*> argument_pointers = pointers_to(arguments);
  const std::vector<char*> environment_pointers = pointers_to(environment);
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) {
    throw Problem("INTERNAL", std::string("no pipe to a client: ") + std::strerror(errno));
  }
  const pid_t parent = ::getpid();
  const pid_t client = ::fork();
  if (client == 0) {
    become_client(call, argument_pointers.data(), environment_pointers.data(), pipe[1], parent);
  }
  ::close(pipe[1]);
  if (client < 0) {
    ::close(pipe[0]);
    throw Problem("INTERNAL", std::string("no process for a client: ") + std::strerror(errno));
  }
  CallResult result;
  Messages messages(result, on_progress);
  follow(client, pipe[0], call, interruptions, result, messages);
  ::close(pipe[0]);
  int status = 0;
  while (::waitpid(client, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  return result;
}

}  // namespace meshsmooth::gateway
