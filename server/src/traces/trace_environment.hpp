#pragma once

#include <functional>
#include <string>

#include "meshsmooth/trace_settings.hpp"

namespace meshsmooth::server {

/// Reads OTEL_… as OpenTelemetry's specification of environment variables has them. Without an
/// endpoint nothing is sent.
/// @param variable  the value of an environment variable; empty: not set
/// @throws InvalidOption that names a variable whose value is not one of those supported
[[nodiscard]] TraceSettings read_trace_settings(
    const std::function<std::string(const std::string& name)>& variable);

}  // namespace meshsmooth::server
