#include <pthread.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "config.hpp"
#include "host_memory.hpp"
#include "log.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/server.hpp"
#include "program.hpp"
#include "socket_folder.hpp"

namespace {

using namespace meshsmooth;

constexpr int kExitUsage = 2;
constexpr int kExitDeviceLost = 69;   // EX_UNAVAILABLE
constexpr int kExitNoResources = 71;  // EX_OSERR
constexpr int kExitNotDrained = 75;   // EX_TEMPFAIL
// Beyond `drop_timeout`; Server::drain needs 0.8 s of it.
constexpr auto kWatchdogSlack = std::chrono::seconds(2);
constexpr auto kStdinEndLimit = std::chrono::milliseconds(1500);

// Blocked here, and so in every thread created later: they are only received by sigwait.
sigset_t block_exit_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

// Each connection takes one, and the soft limit of a service is often 1024.
void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == limit.rlim_max) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

// With fewer no client would ever be served: the server itself opens 20 files, more with a GPU, and
// leaves a quarter of the limit to shared memory.
void check_descriptor_limit() {
  constexpr rlim_t kFiles = 64;
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur < kFiles) {
    throw std::runtime_error("the limit of open files is " + std::to_string(limit.rlim_cur) +
                             ", at least " + std::to_string(kFiles) +
                             " are needed; raise it (ulimit -n, LimitNOFILE)");
  }
}

// Where gRPC and oneTBB get no memory for their threads they abort or wait for ever. An idle server
// of two cores takes 380 MB of address space, mostly stacks.
void check_address_space() {
  constexpr std::size_t kBytes = 384 << 20;
  void* space =
      mmap(nullptr, kBytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (space == MAP_FAILED) {
    throw std::runtime_error("the address space is limited to less than " +
                             std::to_string(kBytes >> 20) +
                             " MiB beyond what the program takes (ulimit -v); raise the limit");
  }
  munmap(space, kBytes);
}

// The only way out once threads run that never end by themselves.
class Exit {
 public:
  /// Creates the folder of a server on "unix:" and completes the addresses that are in it. Throws
  /// InvalidOption.
  void create_socket_folder(server::ServerConfig& config) {
    folder_.emplace("listen");
    config.listen = folder_->address();
    if (config.shared_memory_socket == "unix:") {
      config.shared_memory_socket = folder_->second_address();
    }
  }
  [[noreturn]] void leave(int code) {
    if (folder_) folder_->remove();
    _exit(code);
  }

 private:
  std::optional<server::SocketFolder> folder_;
};

// With a pipe as standard input, its other end is closed however the parent ends, by SIGKILL too.
// Nobody is left to serve then: `serve` ends, and what takes longer, as the start of a GPU, is cut
// off.
void watch_stdin(std::atomic<bool>& ended, Exit& exit) {
  std::thread([&] {
    char ignored[256];
    ssize_t count = 0;
    do {
      count = read(STDIN_FILENO, ignored, sizeof ignored);
    } while (count > 0 || (count < 0 && errno == EINTR));
    ended = true;
    kill(getpid(), SIGTERM);
    std::this_thread::sleep_for(kStdinEndLimit);
    exit.leave(kExitNotDrained);
  }).detach();
}

// SIGTERM drains, a second one forces the shutdown; if even that hangs, the process exits. When no
// lane is left, none comes back within this process: it drains without waiting and exits with its
// own code, so that the supervisor starts another process.
[[noreturn]] void serve(server::Server& server, const server::ServerConfig& config,
                        const sigset_t& signals, const std::atomic<bool>& stdin_ended, Exit& exit) {
  int signal = 0;
  sigwait(&signals, &signal);
  if (server.device_lost() || stdin_ended) server.force_shutdown();

  std::thread([&] {
    int again = 0;
    sigwait(&signals, &again);
    server.force_shutdown();
  }).detach();
  const auto limit = config.lame_duck + config.drain_grace + config.drop_timeout + kWatchdogSlack;
  std::thread([limit, &server, &exit] {
    std::this_thread::sleep_for(limit);
    exit.leave(server.device_lost() ? kExitDeviceLost : kExitNotDrained);
  }).detach();
  server.drain();
  std::fflush(nullptr);
  exit.leave(server.device_lost() ? kExitDeviceLost : 0);
}

// A wrong file of settings may contain anything, also control sequences of terminals.
int fail(std::string what, int code) {
  for (char& c : what) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) c = '?';
  }
  std::fprintf(stderr, "meshsmooth-server: %s\n", what.c_str());
  return code;
}
int fail(const Error& error) { return fail(error.what(), kExitUsage); }

}  // namespace

int main(int argc, char** argv) {
  CLI::App app;
  server::ProgramFlags flags;
  server::add_program_flags(app, flags);
  server::ServerConfig config;
  try {
    config = server::read_config(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitUsage;
  } catch (const Error& error) {
    return fail(error);
  }
  std::string unknown;
  for (const std::string& name : server::unknown_environment()) {
    unknown += (unknown.empty() ? "" : ", ") + name;
  }
  if (!unknown.empty()) unknown = "no such setting, ignored: " + unknown;
  if (flags.print_config) {
    if (!unknown.empty()) fail(unknown, 0);
    std::fputs(server::describe(config).c_str(), stdout);
    return 0;
  }

  server::keep_heap_warm();
  const sigset_t signals = block_exit_signals();
  // The reader of the log may end first.
  std::signal(SIGPIPE, SIG_IGN);
  // Certificates and tokens are reloaded by themselves; the default would end all jobs.
  std::signal(SIGHUP, SIG_IGN);
  raise_descriptor_limit();
  std::atomic<bool> stdin_ended = false;
  Exit exit;
  try {
    check_descriptor_limit();
    check_address_space();
    if (config.listen == "unix:") exit.create_socket_folder(config);
    if (config.exit_with_stdin) watch_stdin(stdin_ended, exit);
    server::Server server(config);
    server.start([] { kill(getpid(), SIGTERM); });
    // After the line that tells callers where the server listens.
    if (!unknown.empty()) server::log_warning("unknown_environment", unknown);
    serve(server, config, signals, stdin_ended, exit);
  } catch (const Error& error) {
    exit.leave(fail(error));
  } catch (const std::exception& error) {  // no memory, no threads
    exit.leave(fail(std::string("cannot start: ") + error.what(), kExitNoResources));
  }
}
