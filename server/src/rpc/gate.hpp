#pragma once

#include <grpcpp/server_context.h>

#include <exception>
#include <memory>

#include "caller.hpp"
#include "meshsmooth/server_config.hpp"
#include "metrics.hpp"
#include "token_file.hpp"

namespace meshsmooth::server {

/// Who comes in by a call, or why not.
struct Entry {
  Caller caller;
  std::exception_ptr denied;  // UNAUTHENTICATED
};

/// The one place that says who a caller is: by a bearer token where the server
/// has a token file, else by the client's certificate, else nobody in particular.
/// Thread-safe.
class Gate {
 public:
  /// Throws InvalidOption when the token file is wrong.
  Gate(const ServerConfig& config, Metrics& metrics);

  /// Call it first of all in every call. Echoes a valid traceparent in the
  /// initial metadata.
  [[nodiscard]] Entry enter(grpc::CallbackServerContext& context) const;

 private:
  [[nodiscard]] std::string identify(const grpc::CallbackServerContext& context) const;

  const std::unique_ptr<TokenFile> tokens_;
  Metrics& metrics_;
};

}  // namespace meshsmooth::server
