#pragma once

#include <grpcpp/server_context.h>

#include <exception>
#include <memory>

#include "caller.hpp"
#include "meshsmooth/server_config.hpp"
#include "metrics.hpp"
#include "rpc/call_limits.hpp"
#include "token_file.hpp"

namespace meshsmooth::server {

/// The caller of a call, or why the call is refused.
struct AuthResult {
  Caller caller;
  std::exception_ptr denied;  // UNAUTHENTICATED
  CallPlace place;            // for the call to keep until it is done
  /// It has more calls than a connection may have: to be refused at once, without ceremony.
  std::exception_ptr over_limit;
};

/// The only place that identifies callers: by a bearer token where the server has a token file,
/// else by the client's certificate; otherwise the caller is anonymous. Thread-safe.
class Authenticator {
 public:
  /// Throws InvalidOption when the token file is invalid.
  Authenticator(const ServerConfig& config, Metrics& metrics, CallLimits& calls);

  /// Must be the first step of every call. Echoes a valid traceparent in the
  /// initial metadata.
  [[nodiscard]] AuthResult authenticate(grpc::CallbackServerContext& context) const;

 private:
  [[nodiscard]] std::string identify(const grpc::CallbackServerContext& context) const;

  const std::unique_ptr<TokenFile> tokens_;
  Metrics& metrics_;
  CallLimits& calls_;
  const bool behind_proxy_;
};

}  // namespace meshsmooth::server
