#pragma once

#include <string>

namespace meshsmooth::server {

/// The caller of a call without credentials.
inline constexpr const char* kAnonymous = "anonymous";

/// Who makes a call, and where it comes from.
struct Caller {
  std::string name = kAnonymous;
  std::string traceparent;  // of W3C's Trace Context; empty: none
  std::string connection;   // its TCP connection; empty: it uses another transport
  /// Whose share of lanes, queue and memory its calls use. Callers without a name are told apart by
  /// where they come from; empty: they cannot be, and have no share of their own.
  std::string share;
};

}  // namespace meshsmooth::server
