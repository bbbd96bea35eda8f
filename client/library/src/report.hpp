#pragma once

#include <string>

#include "meshsmooth/client.hpp"
#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::client {

[[nodiscard]] JobProgress decode_progress(const v1::Progress& message);

/// Throws `ServiceError` when the summary cannot be understood.
[[nodiscard]] SmoothReport decode_report(v1::Summary summary, const std::string& job_name,
                                         const std::string& request_id);

}  // namespace meshsmooth::client
