#pragma once

#include <string_view>

#include "engine.hpp"
#include "meshsmooth/backend_name.hpp"
#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::server {

/// The backend of a device of the engine.
[[nodiscard]] BackendName backend_of(std::string_view device);

/// What the server is, has and allows.
[[nodiscard]] v1::GetServerInfoResponse encode_server_info(const Engine& engine);

}  // namespace meshsmooth::server
