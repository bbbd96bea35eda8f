#pragma once

#include <grpcpp/support/status.h>

#include <string>

#include "meshsmooth/client.hpp"

namespace meshsmooth::client {

/// What the caller of a failed call knows and gRPC does not.
struct CallFacts {
  std::string server;  // as the user named it
  bool cancelled_by_caller = false;
  double timeout_seconds = 0;
  bool answered = true;  // by a first word of the server, at least
};

/// The exception for a status that is not OK.
[[nodiscard]] ServiceError to_service_error(const grpc::Status& status, const CallFacts& facts);

/// The exception for an answer that breaks the protocol.
[[nodiscard]] ServiceError broken_answer(const std::string& what);

}  // namespace meshsmooth::client
