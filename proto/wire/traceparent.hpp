#pragma once

#include <string_view>

namespace meshsmooth::wire {

/// Whether `text` is a traceparent of W3C's Trace Context: 2 hex digits of the
/// version, 32 of the trace, 16 of the parent, 2 of flags, joined by '-'. Later
/// versions may append more.
[[nodiscard]] bool is_traceparent(std::string_view text);

}  // namespace meshsmooth::wire
