#pragma once

#include <grpcpp/support/status.h>

#include <exception>
#include <string>

#include "wire/status_details.hpp"

namespace meshsmooth::server {

/// The one place where exceptions become gRPC status (docs/protocol.md has the
/// table). What is no meshsmooth::Error becomes INTERNAL without its text,
/// naming `incident`, under which the log has it.
[[nodiscard]] wire::StatusDetails describe_error(const std::exception_ptr& error,
                                                 const std::string& incident);

[[nodiscard]] grpc::Status to_status(const wire::StatusDetails& details);

}  // namespace meshsmooth::server
