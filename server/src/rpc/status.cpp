#include "rpc/status.hpp"

#include <new>

#include "busy.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/error_reason.hpp"

namespace meshsmooth::server {
namespace {

using grpc::StatusCode;

static_assert(static_cast<int>(meshsmooth::StatusCode::cancelled) == StatusCode::CANCELLED &&
              static_cast<int>(meshsmooth::StatusCode::internal) == StatusCode::INTERNAL &&
              static_cast<int>(meshsmooth::StatusCode::unauthenticated) ==
                  StatusCode::UNAUTHENTICATED);

wire::StatusDetails details_of(const Error& error, StatusCode code) {
  const ErrorReason* const reason = find_error_reason(error.reason());
  if (reason != nullptr) code = static_cast<StatusCode>(reason->status);
  wire::StatusDetails details{.code = code,
                              .message = error.what(),
                              .reason = error.reason(),
                              .metadata = error.details(),
                              .retry_delay = {}};
  if (const auto* busy = dynamic_cast<const Busy*>(&error)) {
    details.retry_delay = busy->retry_delay();
  } else if (reason != nullptr) {
    details.retry_delay = reason->retry_delay;
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
            .message = "the server failed; its log has the details under " + incident,
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
