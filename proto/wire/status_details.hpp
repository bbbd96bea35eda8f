#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "meshsmooth/error.hpp"

namespace meshsmooth::wire {

/// The domain of every reason that a meshsmooth server gives.
inline constexpr std::string_view kErrorDomain = "meshsmooth.dev";

/// A failed call as it travels in the trailer "grpc-status-details-bin".
struct StatusDetails {
  int code = 0;  // gRPC status code
  std::string message;
  std::string reason;     // ErrorInfo.reason; empty when there is no ErrorInfo of ours
  ErrorDetails metadata;  // ErrorInfo.metadata; decoded in ascending order of keys
  std::optional<std::chrono::nanoseconds> retry_delay;  // RetryInfo; unset: do not retry
};

/// A serialized google.rpc.Status, at most 4 KiB: long texts are cut. A detail
/// "field" also becomes a BadRequest.
[[nodiscard]] std::string encode_status_details(const StatusDetails& details);

/// Nothing when the bytes are no Status. Details of other types and ErrorInfos
/// of other domains are passed over.
[[nodiscard]] std::optional<StatusDetails> decode_status_details(std::string_view bytes);

}  // namespace meshsmooth::wire
