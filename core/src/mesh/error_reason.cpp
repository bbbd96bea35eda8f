#include "meshsmooth/error_reason.hpp"

#include <algorithm>
#include <array>

namespace meshsmooth {
namespace {

using std::chrono::milliseconds;
using enum ErrorOrigin;
constexpr std::nullopt_t kNever = std::nullopt;

constexpr std::array kReasons = {
    ErrorReason{"SPEC_MISSING", server, StatusCode::invalid_argument, ExitCode::failed, kNever,
                "no", "field", "the call does not begin with a complete spec"},
    ErrorReason{"OPTION_OUT_OF_RANGE", server, StatusCode::invalid_argument, ExitCode::usage,
                kNever, "no", "field", "a value is out of its range"},
    ErrorReason{"OPTION_NOT_SUPPORTED", server, StatusCode::invalid_argument, ExitCode::refused,
                kNever, "no", "field",
                "the server or the method does not have this option or value"},
    ErrorReason{"MESH_EMPTY", server, StatusCode::invalid_argument, ExitCode::bad_mesh, kNever,
                "no", "field", "the mesh has no nodes or no elements"},
    ErrorReason{"MIXED_DIMENSIONS", server, StatusCode::invalid_argument, ExitCode::bad_mesh,
                kNever, "no", "field", "surface and volume elements in one mesh"},
    ErrorReason{"CHUNK_OUT_OF_ORDER", server, StatusCode::invalid_argument, ExitCode::failed,
                kNever, "no", "array, offset_bytes", "a chunk does not continue its array"},
    ErrorReason{"ARRAY_SIZE_MISMATCH", server, StatusCode::invalid_argument, ExitCode::bad_mesh,
                kNever, "no", "array, offset_bytes", "an array does not have the announced size"},
    ErrorReason{"INDEX_OUT_OF_RANGE", server, StatusCode::invalid_argument, ExitCode::bad_mesh,
                kNever, "no", "element, node", "an element has a node index that does not exist"},
    ErrorReason{"REPEATED_NODE", server, StatusCode::invalid_argument, ExitCode::bad_mesh, kNever,
                "no", "element, node", "an element has a node twice"},
    ErrorReason{"NON_FINITE_COORDINATE", server, StatusCode::invalid_argument, ExitCode::bad_mesh,
                kNever, "no", "node", "a coordinate is infinite or not a number"},
    ErrorReason{"FACET_OVERUSED", server, StatusCode::invalid_argument, ExitCode::bad_mesh, kNever,
                "no", "facet_nodes", "a facet belongs to more than two elements"},
    ErrorReason{"ALL_ELEMENTS_INVERTED", server, StatusCode::invalid_argument, ExitCode::bad_mesh,
                kNever, "no", "inverted_element_count",
                "every element is inverted: the node order is not VTK's"},
    ErrorReason{"MESH_TANGLED", server, StatusCode::invalid_argument, ExitCode::bad_mesh, kNever,
                "no", "inverted_element_count",
                "inverted elements, and the caller asked to refuse them"},
    ErrorReason{"NON_FINITE_RESULT", server, StatusCode::invalid_argument, ExitCode::failed, kNever,
                "no", "", "positions left the range of the coordinate type"},
    ErrorReason{"CHECKSUM_MISMATCH", server, StatusCode::data_loss, ExitCode::failed, kNever,
                "once, from the start", "array, offset_bytes", "a chunk arrived damaged"},
    ErrorReason{"BACKEND_NOT_AVAILABLE", server, StatusCode::failed_precondition, ExitCode::refused,
                kNever, "no", "field",
                "the backend does not exist here, or the server runs another"},
    ErrorReason{"JOB_NOT_FINISHED", server, StatusCode::failed_precondition, ExitCode::refused,
                kNever, "no", "name", "the job must have ended for this"},
    ErrorReason{"JOB_NOT_FOUND", server, StatusCode::not_found, ExitCode::failed, kNever, "no",
                "name", "no job of the caller has this name, or it is no longer retained"},
    ErrorReason{"RESULT_NOT_KEPT", server, StatusCode::not_found, ExitCode::failed, kNever, "no",
                "name", "the job has ended and its result is not retained"},
    ErrorReason{"TOPOLOGY_NOT_FOUND", server, StatusCode::not_found, ExitCode::failed, kNever,
                "once, inline", "name",
                "no topology of the caller has this name, or it was evicted"},
    ErrorReason{"REQUEST_ID_REUSED", server, StatusCode::already_exists, ExitCode::refused, kNever,
                "no", "field, name", "another job of the caller has this request id"},
    ErrorReason{"RESULT_OFFSET_PAST_END", server, StatusCode::out_of_range, ExitCode::failed,
                kNever, "no", "size_bytes", "the result is shorter than the offset"},
    ErrorReason{"TOKEN_MISSING", server, StatusCode::unauthenticated, ExitCode::refused, kNever,
                "with a token", "", "the server asks for a token"},
    ErrorReason{"TOKEN_UNKNOWN", server, StatusCode::unauthenticated, ExitCode::refused, kNever,
                "with another token", "", "the server does not know the token"},
    ErrorReason{"QUOTA_EXCEEDED", server, StatusCode::resource_exhausted, ExitCode::refused,
                milliseconds(1000), "yes, when a job of the caller has ended",
                "limit_jobs, limit_bytes",
                "the quota of the caller or of its connection is exceeded"},
    ErrorReason{"QUEUE_FULL", server, StatusCode::resource_exhausted, ExitCode::refused, kNever,
                "yes, after the delay", "queued_jobs, queued_bytes", "the queue is full"},
    ErrorReason{"HOST_MEMORY_BUSY", server, StatusCode::resource_exhausted, ExitCode::refused,
                milliseconds(1000), "yes, after the delay", "need_bytes, free_bytes",
                "other jobs use the host's memory"},
    ErrorReason{"DEVICE_MEMORY_BUSY", server, StatusCode::resource_exhausted, ExitCode::refused,
                kNever, "yes, after the delay", "need_bytes, free_bytes",
                "other jobs use the device's memory"},
    ErrorReason{"MESH_TOO_LARGE", server, StatusCode::resource_exhausted, ExitCode::refused, kNever,
                "no", "need_bytes, limit_bytes, space", "the job never fits this server"},
    ErrorReason{"HOST_MEMORY_EXHAUSTED", server, StatusCode::resource_exhausted, ExitCode::refused,
                kNever, "no", "", "the host ran out of memory during the job"},
    ErrorReason{"DEVICE_MEMORY_EXHAUSTED", server, StatusCode::resource_exhausted,
                ExitCode::refused, kNever, "no", "", "the device ran out of memory during the job"},
    ErrorReason{"DEADLINE_IN_QUEUE", server, StatusCode::deadline_exceeded, ExitCode::stopped,
                kNever, "the caller decides", "", "the call's deadline passed in the queue"},
    ErrorReason{"QUEUE_TIMEOUT", server, StatusCode::deadline_exceeded, ExitCode::stopped, kNever,
                "the caller decides", "", "the job waited longer than its queue timeout"},
    ErrorReason{"DEADLINE_RUNNING", server, StatusCode::deadline_exceeded, ExitCode::stopped,
                kNever, "the caller decides", "", "the call's deadline passed during the job"},
    ErrorReason{"STREAM_IDLE", server, StatusCode::deadline_exceeded, ExitCode::stopped, kNever,
                "the caller decides", "", "the client neither sent nor read for too long"},
    ErrorReason{"UPLOAD_TOO_SLOW", server, StatusCode::deadline_exceeded, ExitCode::stopped, kNever,
                "the caller decides", "", "the upload was slower than the server's minimum rate"},
    ErrorReason{"CANCELLED_BY_CLIENT", server, StatusCode::cancelled, ExitCode::stopped, kNever,
                "no", "", "the last call that waited for the job ended"},
    ErrorReason{"CANCELLED_BY_JOB_CALL", server, StatusCode::cancelled, ExitCode::stopped, kNever,
                "no", "", "CancelJob ended the job"},
    ErrorReason{"DRAINING", server, StatusCode::unavailable, ExitCode::refused, milliseconds(0),
                "yes, elsewhere", "", "the server is shutting down"},
    ErrorReason{"DEVICE_LOST", server, StatusCode::unavailable, ExitCode::refused, milliseconds(0),
                "yes, elsewhere", "", "the device failed; its lane is gone"},
    ErrorReason{"DEVICE_REFUSED", server, StatusCode::unavailable, ExitCode::refused,
                milliseconds(0), "yes, elsewhere", "", "the device or its driver refused to work"},
    ErrorReason{"UPLOAD_LOST", server, StatusCode::unavailable, ExitCode::refused, milliseconds(0),
                "yes, at once", "", "the call that sent the mesh ended before it was complete"},
    ErrorReason{"INTERNAL", server, StatusCode::internal, ExitCode::failed, kNever, "no",
                "incident", "the server failed; its log names the incident too"},
    ErrorReason{"RESPONSE_NOT_UNDERSTOOD", client, StatusCode::data_loss, ExitCode::refused, kNever,
                "no", "", "an answer of a newer server that this client cannot read"},
    ErrorReason{"OPTION_MISPLACED", client, StatusCode::invalid_argument, ExitCode::usage, kNever,
                "no", "", "a flag that the chosen method or command does not have"},
    ErrorReason{"FIXED_NODES_INVALID", client, StatusCode::invalid_argument, ExitCode::usage,
                kNever, "no", "", "a file of fixed nodes that is not one"},
    ErrorReason{"FORMAT_UNKNOWN", client, StatusCode::invalid_argument, ExitCode::usage, kNever,
                "no", "", "no file format has this extension"},
    ErrorReason{"CREDENTIALS_UNUSABLE", client, StatusCode::invalid_argument, ExitCode::usage,
                kNever, "no", "", "a certificate, key or token that cannot be used"},
    ErrorReason{"NAME_UNKNOWN", client, StatusCode::invalid_argument, ExitCode::usage, kNever, "no",
                "", "the file has no set or array of this name"},
    ErrorReason{"ARRAY_NOT_WHOLE", client, StatusCode::invalid_argument, ExitCode::usage, kNever,
                "no", "", "an array of regions that are not whole numbers"},
    ErrorReason{"ELEMENT_NOT_SUPPORTED", client, StatusCode::invalid_argument, ExitCode::bad_mesh,
                kNever, "no", "", "an element type that is not supported"},
    ErrorReason{"FORMAT_ERROR", client, StatusCode::invalid_argument, ExitCode::bad_mesh, kNever,
                "no", "", "a file that breaks its format"},
    ErrorReason{"FILE_TRUNCATED", client, StatusCode::invalid_argument, ExitCode::bad_mesh, kNever,
                "no", "", "a file that ends too early"},
    ErrorReason{"FILE_NOT_FOUND", client, StatusCode::not_found, ExitCode::failed, kNever, "no", "",
                "no such file"},
    ErrorReason{"FILE_NOT_READABLE", client, StatusCode::failed_precondition, ExitCode::failed,
                kNever, "no", "", "a file that cannot be read"},
    ErrorReason{"FILE_NOT_WRITABLE", client, StatusCode::failed_precondition, ExitCode::failed,
                kNever, "no", "", "a file that cannot be written"},
    ErrorReason{"GENERATOR_FAILED", client, StatusCode::internal, ExitCode::failed, kNever, "no",
                "", "a mesh generator gave up"},
};

}  // namespace

std::span<const ErrorReason> error_reasons() { return kReasons; }

const ErrorReason* find_error_reason(std::string_view name) {
  const auto* found = std::ranges::find(kReasons, name, &ErrorReason::name);
  return found == kReasons.end() ? nullptr : found;
}

std::string_view status_code_name(StatusCode code) {
  switch (code) {
    case StatusCode::cancelled:
      return "CANCELLED";
    case StatusCode::unknown:
      return "UNKNOWN";
    case StatusCode::invalid_argument:
      return "INVALID_ARGUMENT";
    case StatusCode::deadline_exceeded:
      return "DEADLINE_EXCEEDED";
    case StatusCode::not_found:
      return "NOT_FOUND";
    case StatusCode::already_exists:
      return "ALREADY_EXISTS";
    case StatusCode::permission_denied:
      return "PERMISSION_DENIED";
    case StatusCode::resource_exhausted:
      return "RESOURCE_EXHAUSTED";
    case StatusCode::failed_precondition:
      return "FAILED_PRECONDITION";
    case StatusCode::out_of_range:
      return "OUT_OF_RANGE";
    case StatusCode::unimplemented:
      return "UNIMPLEMENTED";
    case StatusCode::internal:
      return "INTERNAL";
    case StatusCode::unavailable:
      return "UNAVAILABLE";
    case StatusCode::data_loss:
      return "DATA_LOSS";
    case StatusCode::unauthenticated:
      return "UNAUTHENTICATED";
  }
  __builtin_unreachable();
}

}  // namespace meshsmooth
