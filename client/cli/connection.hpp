#pragma once

#include <memory>
#include <optional>
#include <string>

#include "meshsmooth/client.hpp"
#include "meshsmooth/server.hpp"

namespace meshsmooth::cli {

/// Where jobs go: a server at an address or, without one, a server inside this
/// process, reached over the same code path.
class Connection {
 public:
  /// `backend` is for the server inside. Throws what `Server::start` throws.
  Connection(const std::optional<std::string>& address, const std::string& backend);

  [[nodiscard]] client::Client& client() { return *client_; }

 private:
  std::unique_ptr<server::Server> embedded_;
  std::optional<client::Client> client_;  // before its server goes, it does
};

}  // namespace meshsmooth::cli
