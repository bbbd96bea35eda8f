#pragma once

#include <string>

#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::server {

/// The first field in which two specs ask for different jobs, empty when in
/// none. How a call wants to be told (progress, size of chunks) is no part of it.
[[nodiscard]] std::string differing_field(const v1::JobSpec& a, const v1::JobSpec& b);

}  // namespace meshsmooth::server
