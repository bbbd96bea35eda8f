#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "meshsmooth/server_config.hpp"

namespace meshsmooth::server {

/// How `config.listen` is secured: TLS 1.2 or newer with `tls_cert` and `tls_key`, requiring client
/// certificates signed by `tls_client_ca` where that is set; without TLS otherwise. The files are
/// reloaded when they change. Throws InvalidOption (OPTION_OUT_OF_RANGE) when a file is missing or
/// invalid, and for an address without TLS that other machines can reach unless `insecure` is
/// set.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> make_server_credentials(
    const ServerConfig& config);

}  // namespace meshsmooth::server
