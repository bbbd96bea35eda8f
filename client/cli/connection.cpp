#include "connection.hpp"

#include "client_access.hpp"

namespace meshsmooth::cli {

Connection::Connection(const std::optional<std::string>& address, const std::string& backend) {
  if (address) {
    client_.emplace(*address);
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
