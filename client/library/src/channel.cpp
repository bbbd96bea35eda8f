#include "channel.hpp"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/client_interceptor.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <mutex>
#include <utility>
#include <vector>

#include "wire/local_address.hpp"

namespace meshsmooth::client {
namespace {

namespace grpc_experimental = grpc::experimental;

[[noreturn]] void throw_unusable(const std::string& field, const std::string& what) {
  throw InvalidOption("CREDENTIALS_UNUSABLE", field + ": " + what, {{"field", field}});
}

std::string read_file(const std::string& field, const std::string& path) {
  if (path.empty()) return {};
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file || text.empty()) throw_unusable(field, "cannot read " + path + ", or it is empty");
  return text;
}

std::string read_token(const std::string& path) {
  std::string token = read_file("token_file", path);
  token.erase(std::min(token.find_first_of("\r\n"), token.size()));
  const bool visible =
      std::ranges::all_of(token, [](unsigned char c) { return c > 0x20 && c < 0x7f; });
  if (token.empty() || !visible) {
    throw_unusable("token_file", path + " needs the token alone in its first line");
  }
  return token;
}

/// Puts the token on every call. Not gRPC's call credentials: those need TLS even
/// within this machine.
class TokenInterceptor final : public grpc_experimental::Interceptor {
 public:
  explicit TokenInterceptor(std::string token) : token_(std::move(token)) {}
  void Intercept(grpc_experimental::InterceptorBatchMethods* methods) override {
    using grpc_experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_INITIAL_METADATA)) {
      methods->GetSendInitialMetadata()->emplace("authorization", "Bearer " + token_);
    }
    methods->Proceed();
  }

 private:
  const std::string token_;
};

class TokenInterceptorFactory final : public grpc_experimental::ClientInterceptorFactoryInterface {
 public:
  explicit TokenInterceptorFactory(std::string path)
      : path_(std::move(path)), token_(read_token(path_)) {}

  grpc_experimental::Interceptor* CreateClientInterceptor(
      grpc_experimental::ClientRpcInfo*) override {
    return new TokenInterceptor(current_token());  // gRPC deletes it
  }

 private:
  // While a new token is being written, the one before is shown.
  std::string current_token() {
    const std::lock_guard lock(mutex_);
    try {
      token_ = read_token(path_);
    } catch (const InvalidOption&) {
    }
    return token_;
  }

  const std::string path_;
  std::mutex mutex_;
  std::string token_;
};

/// Calls in turn to all servers that say they serve, each asked by health's Watch; one that drains
/// or is gone is left out at once. Whatever only asks is asked again elsewhere; jobs are
/// `Retry`'s.
constexpr const char* kFleetConfig = R"({
  "loadBalancingConfig": [{"round_robin": {}}],
  "healthCheckConfig": {"serviceName": "meshsmooth.v1.SmoothingService"},
  "methodConfig": [{
    "name": [{"service": "meshsmooth.v1.SmoothingService", "method": "GetServerInfo"},
             {"service": "meshsmooth.v1.SmoothingService", "method": "ListJobs"},
             {"service": "meshsmooth.v1.SmoothingService", "method": "GetJob"}],
    "retryPolicy": {"maxAttempts": 4, "initialBackoff": "0.1s", "maxBackoff": "2s",
                    "backoffMultiplier": 2, "retryableStatusCodes": ["UNAVAILABLE"]}
  }],
  "retryThrottling": {"maxTokens": 10, "tokenRatio": 0.1}
})";

/// A server alone is asked as it is: even while it drains it has answers, and reasons to refuse.
bool names_a_fleet(const std::string& target) {
  return std::ranges::any_of(std::array{"dns:", "ipv4:", "ipv6:"},
                             [&](const char* scheme) { return target.starts_with(scheme); });
}

bool uses_tls(const Credentials& credentials) {
  return credentials.tls || !credentials.tls_ca.empty() || !credentials.tls_cert.empty() ||
         !credentials.tls_key.empty() || !credentials.tls_server_name.empty();
}

std::shared_ptr<grpc::ChannelCredentials> transport(const std::string& target,
                                                    const Credentials& credentials) {
  if (!uses_tls(credentials)) {
    if (!credentials.token_file.empty() && !wire::is_local_address(target)) {
      throw_unusable("token_file", "the token would travel to " + target + " in clear; use TLS");
    }
    return grpc::InsecureChannelCredentials();
  }
  if (credentials.tls_cert.empty() != credentials.tls_key.empty()) {
    throw_unusable(credentials.tls_cert.empty() ? "tls_cert" : "tls_key",
                   "a certificate and its key belong together");
  }
  grpc::SslCredentialsOptions options;
  options.pem_root_certs = read_file("tls_ca", credentials.tls_ca);
  options.pem_cert_chain = read_file("tls_cert", credentials.tls_cert);
  options.pem_private_key = read_file("tls_key", credentials.tls_key);
  return grpc::SslCredentials(options);
}

}  // namespace

std::shared_ptr<grpc::Channel> open_channel(const std::string& target,
                                            const Credentials& credentials) {
  // Finds out within a minute when a server has gone without a word. Servers
  // allow a ping every 15 s.
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20'000);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  // As many connections as clients: else gRPC has all of a process share one.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  if (names_a_fleet(target)) {
    arguments.SetServiceConfigJSON(kFleetConfig);
    // Names are looked up anew when a connection ends, and so often at most.
    arguments.SetInt(GRPC_ARG_DNS_MIN_TIME_BETWEEN_RESOLUTIONS_MS, 2'000);
  }
  if (!credentials.tls_server_name.empty()) {
    arguments.SetSslTargetNameOverride(credentials.tls_server_name);
  }
  std::vector<std::unique_ptr<grpc_experimental::ClientInterceptorFactoryInterface>> interceptors;
  if (!credentials.token_file.empty()) {
    interceptors.push_back(std::make_unique<TokenInterceptorFactory>(credentials.token_file));
  }
  return grpc_experimental::CreateCustomChannelWithInterceptors(
      target, transport(target, credentials), arguments, std::move(interceptors));
}

}  // namespace meshsmooth::client
