#pragma once

#include <grpcpp/impl/service_type.h>

#include <memory>

#include "engine.hpp"
#include "rpc/authenticator.hpp"

namespace meshsmooth::server {

/// The calls of meshsmooth.v1. `engine` and `authenticator` must outlive the result.
[[nodiscard]] std::unique_ptr<grpc::Service> make_smoothing_service(
    Engine& engine, const Authenticator& authenticator);

}  // namespace meshsmooth::server
