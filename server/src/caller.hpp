#pragma once

#include <string>

namespace meshsmooth::server {

/// Who asks when nothing says who.
inline constexpr const char* kAnonymous = "anonymous";

/// Who asks, and as part of what.
struct Caller {
  std::string identity = kAnonymous;
  std::string traceparent;  // of W3C's Trace Context; empty: none
};

}  // namespace meshsmooth::server
