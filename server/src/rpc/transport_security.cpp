#include "rpc/transport_security.hpp"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <grpcpp/version_info.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <string>

#include "meshsmooth/error.hpp"
#include "wire/local_address.hpp"

namespace meshsmooth::server {
namespace {

[[noreturn]] void throw_wrong(const std::string& field, const std::string& what) {
  throw InvalidOption("OPTION_OUT_OF_RANGE", field + ": " + what, {{"field", field}});
}

std::string last_openssl_error() {
  const unsigned long error = ERR_peek_error();  // the first: others follow from it
  ERR_clear_error();
  if (ERR_SYSTEM_ERROR(error)) return std::strerror(ERR_GET_REASON(error));
  const char* reason = ERR_reason_error_string(error);
  return reason == nullptr ? "it cannot be read" : reason;
}

// The last one whose known vulnerabilities let whoever can connect exhaust the server: streams
// beyond the limit, endless headers, rapid resets (CVE-2023-44487, CVE-2023-33953, CVE-2024-7246).
constexpr bool kOldGrpc = GRPC_CPP_VERSION_MAJOR == 1 && GRPC_CPP_VERSION_MINOR < 66;

void check_reachability(const ServerConfig& config) {
  if (config.listen.empty() || wire::is_local_address(config.listen)) return;
  if (config.tls_cert.empty() && !config.insecure) {
    throw_wrong("listen",
                "other machines can reach " + config.listen +
                    " without TLS: set tls-cert and tls-key, or insecure where something else "
                    "protects it");
  }
  if (kOldGrpc && !config.behind_proxy && !config.i_accept_old_grpc) {
    throw_wrong("listen",
                "other machines can reach " + config.listen +
                    ", and this server has gRPC " GRPC_CPP_VERSION_STRING
                    ", in which anyone who can connect can exhaust its memory: set behind-proxy "
                    "where only a proxy that cuts off floods can reach it (deploy/haproxy), or "
                    "i-accept-old-grpc where all who can reach it are trusted");
  }
}

// Without this check gRPC would only fail each handshake.
void check_files(const ServerConfig& config) {
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_server_method()),
                                                                  &SSL_CTX_free);
  // Nobody can enter a pass phrase.
  SSL_CTX_set_default_passwd_cb(context.get(), [](char*, int, int, void*) { return 0; });
  const auto check = [](bool right, const std::string& field, const std::string& path) {
    if (!right) throw_wrong(field, path + ": " + last_openssl_error());
  };
  check(SSL_CTX_use_certificate_chain_file(context.get(), config.tls_cert.c_str()) == 1, "tls-cert",
        config.tls_cert);
  check(SSL_CTX_use_PrivateKey_file(context.get(), config.tls_key.c_str(), SSL_FILETYPE_PEM) == 1,
        "tls-key", config.tls_key);
  check(SSL_CTX_check_private_key(context.get()) == 1, "tls-key", config.tls_key);
  if (!config.tls_client_ca.empty()) {
    check(SSL_CTX_load_verify_locations(context.get(), config.tls_client_ca.c_str(), nullptr) == 1,
          "tls-client-ca", config.tls_client_ca);
  }
}

namespace tls = grpc::experimental;

// A template, so that only the names that this gRPC has are looked up: others since 1.80.
template <class Options, class Files>
std::shared_ptr<grpc::ServerCredentials> tls_credentials(const std::shared_ptr<Files>& files,
                                                         bool asks_clients) {
  const auto use = [&](Options& options) {
    if (asks_clients) {
      options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
    }
    return tls::TlsServerCredentials(options);
  };
  if constexpr (requires { Options::Create(files); }) {
    auto options = Options::Create(files);  // fails only without files
    if (asks_clients) options->set_root_certificate_provider(files);
    return use(*options);
  } else {
    Options options(files);
    options.watch_identity_key_cert_pairs();
    if (asks_clients) options.watch_root_certs();
    return use(options);
  }
}

}  // namespace

std::shared_ptr<grpc::ServerCredentials> make_server_credentials(const ServerConfig& config) {
  if (config.tls_cert.empty() != config.tls_key.empty()) {
    throw_wrong(config.tls_cert.empty() ? "tls-cert" : "tls-key",
                "a certificate and its key belong together: set both, or neither");
  }
  if (config.tls_cert.empty()) {
    if (!config.tls_client_ca.empty()) {
      throw_wrong("tls-client-ca", "client certificates need TLS: set tls-cert and tls-key");
    }
    check_reachability(config);
    return grpc::InsecureServerCredentials();
  }

  check_reachability(config);
  check_files(config);
  const auto interval = std::max(
      std::chrono::seconds(1),
      std::chrono::duration_cast<std::chrono::seconds>(config.credentials_reload_interval));
  return tls_credentials<tls::TlsServerCredentialsOptions>(
      std::make_shared<tls::FileWatcherCertificateProvider>(
          config.tls_key, config.tls_cert, config.tls_client_ca,
          static_cast<unsigned>(interval.count())),
      !config.tls_client_ca.empty());
}

}  // namespace meshsmooth::server
