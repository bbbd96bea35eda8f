#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "meshsmooth/server_config.hpp"

namespace meshsmooth::server {

/// How `config.listen` is secured: TLS 1.2 or newer with `tls_cert` and `tls_key`,
/// of clients a certificate under `tls_client_ca` where that is set; in clear
/// without. The files are read again when they change. Throws InvalidOption
/// (OPTION_OUT_OF_RANGE) when a file is missing or wrong, and when the address is
/// in clear though others reach it and `insecure` does not say so.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> make_server_credentials(
    const ServerConfig& config);

}  // namespace meshsmooth::server
