#include "connection.hpp"

#include <CLI/Option.hpp>
#include <string>
#include <vector>

#include "client_access.hpp"

namespace meshsmooth::cli {

void add_server_flags(CLI::App& app, ServerAddress& server, bool required) {
  CLI::Option* address = app.add_option(
      "--server", server.address,
      std::string("Server address: HOST:PORT, unix:PATH or, for several servers in turn, "
                  "dns:///NAME:PORT") +
          (required ? "" : " [an embedded server]"));
  if (required) address->required();
  client::Credentials& credentials = server.credentials;
  const std::vector<CLI::Option*> options = {
      app.add_flag("--tls", credentials.tls, "TLS; implied by the next four flags"),
      app.add_option("--tls-ca", credentials.tls_ca,
                     "PEM file of the authorities that may sign the server's certificate [the "
                     "system's]"),
      app.add_option("--tls-cert", credentials.tls_cert,
                     "PEM file of the client certificate, for servers that require one"),
      app.add_option("--tls-key", credentials.tls_key, "PEM file of the key of --tls-cert"),
      app.add_option("--tls-server-name", credentials.tls_server_name,
                     "Name in the server's certificate [the host of --server]"),
      app.add_option("--token-file", credentials.token_file,
                     "File with the caller's bearer token")};
  for (CLI::Option* option : options) option->needs(address)->group("Security");
}

Connection::Connection(const ServerAddress& server, const std::string& backend) {
  if (!server.address.empty()) {
    client_.emplace(server.connect());
    return;
  }
  embedded_ = std::make_unique<server::Server>(server::ServerConfig{.listen = "",
                                                                    .backend = backend,
                                                                    .lanes = 1,
                                                                    .lame_duck_seconds = 0,
                                                                    .warm_up = false,
                                                                    .log_level = "off"});
  embedded_->start();
  client_ = client::ClientAccess::make(embedded_->in_process_channel());
}

}  // namespace meshsmooth::cli
