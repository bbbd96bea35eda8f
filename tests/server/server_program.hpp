#pragma once

#include <fcntl.h>
#include <grpcpp/create_channel.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "meshsmooth/v1/smoothing.grpc.pb.h"

namespace meshsmooth::testing {

/// meshsmooth-server as a process of its own, on the CPU with one lane.
class ServerProgram {
 public:
  /// On a free port, or on this one, with these flags besides. `prepare` runs in the new process
  /// before the program.
  explicit ServerProgram(
      int port = 0, const std::vector<std::string>& flags = {"--host-memory-limit-bytes", "2GiB"},
      const std::function<void()>& prepare = [] {}) {
    std::vector<std::string> words = {MESHSMOOTH_SERVER_PROGRAM,
                                      "--listen",
                                      "127.0.0.1:" + std::to_string(port),
                                      "--backend",
                                      "cpu",
                                      "--lanes",
                                      "1"};
    words.insert(words.end(), flags.begin(), flags.end());
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    std::array<int, 2> log{};
    if (pipe2(log.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    process_ = fork();
    if (process_ == 0) {
      prepare();
      dup2(log[1], STDERR_FILENO);
      execv(arguments[0], arguments.data());
      _exit(127);
    }
    close(log[1]);
    log_ = log[0];
    read_ports();
    // Nobody wants the rest, but a full pipe would hold the server up.
    reader_ = std::thread([this] {
      for (std::array<char, 4096> rest; read(log_, rest.data(), rest.size()) > 0;) {
      }
    });
  }
  ~ServerProgram() {
    kill();
    if (reader_.joinable()) reader_.join();
    close(log_);
  }
  ServerProgram(const ServerProgram&) = delete;
  ServerProgram& operator=(const ServerProgram&) = delete;

  void kill() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    process_ = -1;
  }

  [[nodiscard]] pid_t process() const { return process_; }
  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] int admin_port() const { return admin_port_; }
  [[nodiscard]] std::string target() const { return "127.0.0.1:" + std::to_string(port_); }
  [[nodiscard]] v1::SmoothingService::Stub connect() const {
    return v1::SmoothingService::Stub(
        grpc::CreateChannel(target(), grpc::InsecureChannelCredentials()));
  }

 private:
  // From the line "event=start … port=N admin_port=N …".
  void read_ports() {
    std::string text;
    for (char c = 0; read(log_, &c, 1) == 1;) {
      text += c;
      const auto port = text.find(" port="), admin = text.find(" admin_port=");
      if (c != ' ' || admin == std::string::npos || admin + 13 >= text.size()) continue;
      port_ = std::stoi(text.substr(port + 6));
      admin_port_ = std::stoi(text.substr(admin + 12));
      return;
    }
    throw std::runtime_error("the server did not start: " + text);
  }

  pid_t process_ = -1;
  int log_ = -1;
  std::thread reader_;
  int port_ = 0, admin_port_ = 0;
};

}  // namespace meshsmooth::testing
