#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <optional>
#include <string>

#include "meshsmooth/client.hpp"
#include "meshsmooth/server.hpp"

namespace meshsmooth::cli {

/// A server as the command line names it.
struct ServerAddress {
  std::string address;  // empty: none was named
  client::Credentials credentials;

  [[nodiscard]] client::Client connect() const { return client::Client(address, credentials); }
};

/// --server and what secures the way there.
void add_server_flags(CLI::App& app, ServerAddress& server, bool required = true);

/// Where jobs go: a server at an address or, without one, a server inside this
/// process, reached over the same code path.
class Connection {
 public:
  /// `backend` is for the server inside. Throws what `Server::start` throws.
  Connection(const ServerAddress& server, const std::string& backend);

  [[nodiscard]] client::Client& client() { return *client_; }

 private:
  std::unique_ptr<server::Server> embedded_;
  std::optional<client::Client> client_;  // before its server goes, it does
};

}  // namespace meshsmooth::cli
