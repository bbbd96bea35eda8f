#pragma once

#include <grpcpp/create_channel.h>

#include <csignal>
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
  /// On a free port, or on this one.
  explicit ServerProgram(int port = 0, const std::vector<std::string>& flags = {}) {
    std::vector<std::string> command = {MESHSMOOTH_SERVER_PROGRAM,
                                        "--listen",
                                        "127.0.0.1:" + std::to_string(port),
                                        "--backend",
                                        "cpu",
                                        "--lanes",
                                        "1"};
    command.insert(command.end(), flags.begin(), flags.end());
    process_ = std::make_unique<Process>(std::move(command), folder_.path("log"),
                                         Surroundings{{"MESHSMOOTH_HOST_MEMORY_LIMIT_BYTES=2GiB"}});
    port_ = read_port();
  }

  void kill() {
    process_->signal(SIGKILL);
    process_->wait();
  }
  [[nodiscard]] Process& process() { return *process_; }
  [[nodiscard]] std::string log() const { return text_of(folder_.path("log")); }

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] std::string target() const { return "127.0.0.1:" + std::to_string(port_); }
  /// Over a connection of its own.
  [[nodiscard]] std::shared_ptr<grpc::Channel> connect() const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(target(), grpc::InsecureChannelCredentials(), arguments);
  }

 private:
  // From the line "event=start … port=N …".
  int read_port() {
    int port = 0;
    eventually([&] {
      const std::string text = log();
      const auto at = text.find(" port=");
      if (at != std::string::npos && text.find('\n', at) != std::string::npos) {
        port = std::stoi(text.substr(at + 6));
      }
      return port != 0 || process_->ended();
    });
    if (port == 0) throw std::runtime_error("the server did not start: " + log());
    return port;
  }

  const ScratchFolder folder_;
  std::unique_ptr<Process> process_;
  int port_ = 0;
};

}  // namespace meshsmooth::testing
