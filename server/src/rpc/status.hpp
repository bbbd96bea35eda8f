#pragma once

#include <grpcpp/support/status.h>

#include <exception>
#include <string>

#include "wire/status_details.hpp"

namespace meshsmooth::server {

/// The only place that turns exceptions into gRPC status (docs/protocol.md has the table).
/// Anything but a meshsmooth::Error becomes INTERNAL without its text, naming `incident`, by which
/// the log entry can be found.
[[nodiscard]] wire::StatusDetails describe_error(const std::exception_ptr& error,
                                                 const std::string& incident);

[[nodiscard]] grpc::Status to_status(const wire::StatusDetails& details);

}  // namespace meshsmooth::server
