#include "rpc/status.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <new>
#include <string_view>

#include "busy.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

using grpc::StatusCode;
using namespace std::chrono_literals;

// Reasons whose code does not follow from the type of the exception.
struct ReasonCode {
  std::string_view reason;
  StatusCode code;
};
constexpr std::array kReasonCodes = {
    ReasonCode{"CHECKSUM_MISMATCH", StatusCode::DATA_LOSS},
    ReasonCode{"BACKEND_NOT_AVAILABLE", StatusCode::FAILED_PRECONDITION},
    ReasonCode{"TOKEN_MISSING", StatusCode::UNAUTHENTICATED},
    ReasonCode{"TOKEN_UNKNOWN", StatusCode::UNAUTHENTICATED},
    ReasonCode{"JOB_NOT_FOUND", StatusCode::NOT_FOUND},
    ReasonCode{"JOB_NOT_FINISHED", StatusCode::FAILED_PRECONDITION},
    ReasonCode{"TOPOLOGY_NOT_FOUND", StatusCode::NOT_FOUND},
    ReasonCode{"RESULT_NOT_KEPT", StatusCode::NOT_FOUND},
    ReasonCode{"RESULT_OFFSET_PAST_END", StatusCode::OUT_OF_RANGE},
    ReasonCode{"REQUEST_ID_REUSED", StatusCode::ALREADY_EXISTS},
    ReasonCode{"UPLOAD_LOST", StatusCode::UNAVAILABLE},
    ReasonCode{"DRAINING", StatusCode::UNAVAILABLE},
    ReasonCode{"DEVICE_LOST", StatusCode::UNAVAILABLE},
    ReasonCode{"DEVICE_REFUSED", StatusCode::UNAVAILABLE},
};

// Temporary refusals other than `Busy`: when to retry.
struct RetryDelay {
  std::string_view reason;
  std::chrono::nanoseconds delay;
};
constexpr std::array kRetryDelays = {
    RetryDelay{"QUOTA_EXCEEDED", 1s}, RetryDelay{"HOST_MEMORY_BUSY", 1s},
    RetryDelay{"DRAINING", 0s},       RetryDelay{"DEVICE_LOST", 0s},
    RetryDelay{"DEVICE_REFUSED", 0s}, RetryDelay{"UPLOAD_LOST", 0s},
};

wire::StatusDetails details_of(const Error& error, StatusCode code) {
  const auto* reason = std::ranges::find(kReasonCodes, error.reason(), &ReasonCode::reason);
  if (reason != kReasonCodes.end()) code = reason->code;
  wire::StatusDetails details{.code = code,
                              .message = error.what(),
                              .reason = error.reason(),
                              .metadata = error.details(),
                              .retry_delay = {}};
  const auto* retry = std::ranges::find(kRetryDelays, error.reason(), &RetryDelay::reason);
  if (const auto* busy = dynamic_cast<const Busy*>(&error)) {
    details.retry_delay = busy->retry_delay();
  } else if (retry != kRetryDelays.end()) {
    details.retry_delay = retry->delay;
  }
  return details;
}

}  // namespace

wire::StatusDetails describe_error(const std::exception_ptr& error, const std::string& incident) {
  try {
    std::rethrow_exception(error);
  } catch (const InvalidMesh& e) {
    return details_of(e, StatusCode::INVALID_ARGUMENT);
  } catch (const InvalidOption& e) {
    return details_of(e, StatusCode::INVALID_ARGUMENT);
  } catch (const NotSupported& e) {
    return details_of(e, StatusCode::INVALID_ARGUMENT);
  } catch (const OutOfMemory& e) {
    return details_of(e, StatusCode::RESOURCE_EXHAUSTED);
  } catch (const Cancelled& e) {
    return details_of(e, StatusCode::CANCELLED);
  } catch (const DeadlineExceeded& e) {
    return details_of(e, StatusCode::DEADLINE_EXCEEDED);
  } catch (const DeviceError& e) {
    return details_of(e, e.fatal() ? StatusCode::UNAVAILABLE : StatusCode::INTERNAL);
  } catch (const Error& e) {
    return details_of(e, StatusCode::INTERNAL);
  } catch (const std::bad_alloc&) {
    return details_of(OutOfMemory("HOST_MEMORY_BUSY", "the server ran out of memory; try again"),
                      StatusCode::RESOURCE_EXHAUSTED);
  } catch (...) {
    return {.code = StatusCode::INTERNAL,
            .message = "internal server error; the server log has the details of " + incident,
            .reason = "INTERNAL",
            .metadata = {{"incident", incident}},
            .retry_delay = {}};
  }
}

grpc::Status to_status(const wire::StatusDetails& details) {
  return {static_cast<StatusCode>(details.code), details.message,
          wire::encode_status_details(details)};
}

}  // namespace meshsmooth::server
