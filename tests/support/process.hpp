#pragma once

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace meshsmooth::testing {

/// Waits until it is true; false when that took longer than any machine should need.
template <class Condition>
bool eventually(const Condition& is_true,
                std::chrono::steady_clock::duration patience = std::chrono::seconds(60)) {
  const auto limit = std::chrono::steady_clock::now() + patience;
  while (!is_true()) {
    if (std::chrono::steady_clock::now() > limit) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

/// Where an installed program is; empty: nowhere.
inline std::string find_program(const std::string& name) {
  for (const char* const folder : {"/usr/sbin/", "/usr/bin/", "/sbin/", "/bin/"}) {
    if (access((folder + name).c_str(), X_OK) == 0) return folder + name;
  }
  return {};
}

inline std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// What a program finds.
struct Surroundings {
  std::vector<std::string> environment = {};  // NAME=VALUE, beside this process's own
  int inherited_file = -1;                    // stays open there under its number
  std::function<void()> prepare = {};         // runs there before the program
};

/// Another program, killed at the latest when the test ends. Its output goes into a file.
class Process {
 public:
  Process(std::vector<std::string> command, const std::filesystem::path& log,
          Surroundings surroundings = {}) {
    for (char** entry = environ; *entry != nullptr; ++entry) {
      surroundings.environment.emplace_back(*entry);
    }
    const std::vector<char*> arguments = pointers(command);
    const std::vector<char*> environment = pointers(surroundings.environment);
    const int output = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    id_ = fork();
    if (id_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      // sigset_t is inherited, and gRPC's threads have their own.
      sigset_t none;
      sigemptyset(&none);
      sigprocmask(SIG_SETMASK, &none, nullptr);
      dup2(output, STDOUT_FILENO);
      dup2(output, STDERR_FILENO);
      if (surroundings.inherited_file >= 0) fcntl(surroundings.inherited_file, F_SETFD, 0);
      if (surroundings.prepare) surroundings.prepare();
      execve(arguments[0], arguments.data(), environment.data());
      _exit(127);
    }
    close(output);
  }
  ~Process() {
    if (ended()) return;
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  [[nodiscard]] pid_t id() const { return id_; }
  void signal(int number) const {
    if (!status_) kill(id_, number);
  }
  [[nodiscard]] bool ended() {
    int status = 0;
    if (!status_ && waitpid(id_, &status, WNOHANG) == id_) status_ = status;
    return status_.has_value();
  }
  /// The exit code once it has ended; 128 + n by signal n, -1 when it does not end.
  int wait() {
    if (!eventually([this] { return ended(); })) return -1;
    return WIFEXITED(*status_) ? WEXITSTATUS(*status_) : 128 + WTERMSIG(*status_);
  }

 private:
  static std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
  }

  pid_t id_ = -1;
  std::optional<int> status_;
};

}  // namespace meshsmooth::testing
