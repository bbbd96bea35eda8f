#pragma once

#include <grpcpp/server_builder.h>

#include "listener.hpp"
#include "meshsmooth/server_config.hpp"
#include "rpc/call_limits.hpp"

namespace meshsmooth::server {

/// Sets gRPC's own limits. `transport_bytes`: what it may have for connections, calls and messages
/// that nobody took yet.
void configure_transport(grpc::ServerBuilder& builder, const ServerConfig& config,
                         std::int64_t transport_bytes);

[[nodiscard]] CallLimits::Limits call_limits(const ServerConfig& config);

[[nodiscard]] Listener::Limits listener_limits(const ServerConfig& config);

/// Warns where the limit of open files leaves room for fewer than `max_connections` more; throws
/// std::runtime_error where hardly anybody could connect.
void check_descriptors(const ServerConfig& config);

}  // namespace meshsmooth::server
