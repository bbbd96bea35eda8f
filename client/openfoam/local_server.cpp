#include "local_server.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <vector>

extern char** environ;

namespace meshsmooth_foam {
namespace {

using namespace std::chrono_literals;

constexpr auto kStartTimeout = 60s;
constexpr auto kPollInterval = 2ms;

/// This process's, without the settings that are meant for servers that others use.
std::vector<char*> environment() {
  static constexpr std::array<std::string_view, 7> foreign{
      "MESHSMOOTH_CONFIG", "MESHSMOOTH_LISTEN", "MESHSMOOTH_ADMIN_LISTEN", "MESHSMOOTH_TOKEN_FILE",
      "MESHSMOOTH_TLS_",   "MESHSMOOTH_LOG_",   "MESHSMOOTH_INSECURE"};
  std::vector<char*> kept;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string_view text = *variable;
    if (std::none_of(foreign.begin(), foreign.end(), [text](std::string_view name) {
          return text.substr(0, name.size()) == name;
        })) {
      kept.push_back(*variable);
    }
  }
  kept.push_back(nullptr);
  return kept;
}

std::string last_lines(const std::string& log, int count) {
  std::size_t from = log.size();
  for (; count >= 0 && from != 0 && from != std::string::npos; --count) {
    from = log.rfind('\n', from - 1);
  }
  return from == std::string::npos ? log : log.substr(from);
}

}  // namespace

LocalServer::LocalServer(const std::string& program) : program_(program) {
  int input[2];
  if (pipe2(input, O_CLOEXEC) != 0) throw std::runtime_error(std::strerror(errno));
  input_ = input[1];
  // A file, not a pipe: nothing has to read it, so that the server never waits.
  char name[] = "/tmp/meshsmooth-log-XXXXXX";
  log_ = mkostemp(name, O_APPEND | O_CLOEXEC);
  if (log_ >= 0) unlink(name);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input[0], STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, log_, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);  // a terminal's Ctrl-C is not for it
  std::array arguments{program_.data(), const_cast<char*>("--listen"), const_cast<char*>("unix:"),
                       const_cast<char*>("--exit-with-stdin"), static_cast<char*>(nullptr)};
  const int failure = posix_spawnp(&process_, program_.c_str(), &actions, &attributes,
                                   arguments.data(), environment().data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  close(input[0]);
  if (failure != 0) {
    process_ = -1;
    end();
    throw std::runtime_error("cannot run " + program_ + ": " + std::strerror(failure));
  }

  const auto deadline = std::chrono::steady_clock::now() + kStartTimeout;
  while (address_.empty()) {
    const std::string text = log();
    const std::size_t start = text.find(" event=start ");
    if (start != std::string::npos && text.find('\n', start) != std::string::npos) {
      std::size_t value = text.find(" listen=", start) + std::strlen(" listen=");
      const char stop = text[value] == '"' ? '"' : ' ';
      if (stop == '"') ++value;
      address_ = text.substr(value, text.find(stop, value) - value);
      break;
    }
    const bool ended = waitpid(process_, nullptr, WNOHANG) == process_;
    if (ended) process_ = -1;
    if (ended || std::chrono::steady_clock::now() > deadline) {
      const std::string lines = last_lines(log(), 5);
      if (!ended) kill(process_, SIGKILL);
      end();
      throw std::runtime_error(program_ + (ended ? " ended" : " did not serve within 60 s") +
                               "; its last lines: " + lines);
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

LocalServer::~LocalServer() { end(); }

std::string LocalServer::log() const {
  std::string text;
  std::array<char, 4096> part;
  ssize_t count = 0;
  while ((count = pread(log_, part.data(), part.size(), static_cast<off_t>(text.size()))) > 0) {
    text.append(part.data(), static_cast<std::size_t>(count));
  }
  return text;
}

void LocalServer::end() {
  if (input_ >= 0) close(input_);
  input_ = -1;
  if (process_ > 0) waitpid(process_, nullptr, 0);
  process_ = -1;
  if (log_ >= 0) close(log_);
  log_ = -1;
}

}  // namespace meshsmooth_foam
