#pragma once

#include <string>

namespace meshsmooth::client {

/// A random UUID (RFC 4122, version 4).
[[nodiscard]] std::string make_request_id();

}  // namespace meshsmooth::client
