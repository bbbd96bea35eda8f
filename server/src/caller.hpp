#pragma once

#include <string>

namespace meshsmooth::server {

/// Who asks when nothing says who.
inline constexpr const char* kAnonymous = "anonymous";

/// Who asks, and as part of what.
struct Caller {
  std::string identity = kAnonymous;
  std::string traceparent;  // of W3C's Trace Context; empty: none
  std::string connection;   // its TCP connection; empty: it uses another transport
};

}  // namespace meshsmooth::server
