#pragma once

#include <grpcpp/create_channel.h>

#include <csignal>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/process.hpp"
#include "support/scratch_folder.hpp"

namespace meshsmooth::testing {

/// meshsmooth-server as a process of its own: on the CPU, with one lane, on loopback.
class ServerProgram {
 public:
  /// On a free port, or on this one, with these flags besides. `prepare` runs in the new process
  /// before the program.
  explicit ServerProgram(int port = 0, const std::vector<std::string>& flags = {},
                         const std::function<void()>& prepare = {}) {
    std::vector<std::string> command = {MESHSMOOTH_SERVER_PROGRAM,
                                        "--listen",
                                        "127.0.0.1:" + std::to_string(port),
                                        "--backend",
                                        "cpu",
                                        "--lanes",
                                        "1"};
    command.insert(command.end(), flags.begin(), flags.end());
    process_ = std::make_unique<Process>(std::move(command), folder_.path("log"),
                                         // A server that is killed leaves its sockets there.
                                         Surroundings{{"MESHSMOOTH_HOST_MEMORY_LIMIT_BYTES=2GiB",
                                                       "TMPDIR=" + folder_.path().string()},
                                                      -1,
                                                      prepare});
    read_ports();
  }

  void kill() {
    process_->signal(SIGKILL);
    process_->wait();
  }
  [[nodiscard]] Process& process() { return *process_; }
  [[nodiscard]] std::string log() const { return text_of(folder_.path("log")); }

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] int admin_port() const { return admin_port_; }
  [[nodiscard]] std::string target() const { return "127.0.0.1:" + std::to_string(port_); }
  /// Over a connection of its own.
  [[nodiscard]] std::shared_ptr<grpc::Channel> connect() const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(target(), grpc::InsecureChannelCredentials(), arguments);
  }

 private:
  // From the line "event=start … port=N admin_port=N …".
  void read_ports() {
    eventually([&] {
      const std::string text = log();
      const auto port = text.find(" port="), admin = text.find(" admin_port=");
      if (admin == std::string::npos || text.find('\n', admin) == std::string::npos) {
        return process_->ended();
      }
      port_ = std::stoi(text.substr(port + 6));
      admin_port_ = std::stoi(text.substr(admin + 12));
      return true;
    });
    if (port_ == 0) throw std::runtime_error("the server did not start: " + log());
  }

  const ScratchFolder folder_;
  std::unique_ptr<Process> process_;
  int port_ = 0, admin_port_ = 0;
};

}  // namespace meshsmooth::testing
