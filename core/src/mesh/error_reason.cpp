#include "meshsmooth/error_reason.hpp"

#include <algorithm>
#include <iterator>

namespace meshsmooth {
namespace {

using std::chrono::milliseconds;
using enum ErrorOrigin;
using enum StatusCode;
using enum ExitCode;

constexpr ErrorReason kReasons[] = {
    {"SPEC_MISSING", server, invalid_argument, failed, "field",
     "the call does not begin with a complete spec"},
    {"OPTION_OUT_OF_RANGE", server, invalid_argument, usage, "field",
     "a value is out of its range"},
    {"OPTION_NOT_SUPPORTED", server, invalid_argument, refused, "field",
     "the server or the method does not have this option or value"},
    {"MESH_EMPTY", server, invalid_argument, bad_mesh, "field",
     "the mesh has no nodes or no elements"},
    {"MIXED_DIMENSIONS", server, invalid_argument, bad_mesh, "field",
     "surface and volume elements in one mesh"},
    {"MIXED_ORDERS", server, invalid_argument, bad_mesh, "field",
     "linear elements and elements of second order in one mesh"},
    {"MID_NODE_MISPLACED", server, invalid_argument, bad_mesh, "element, node",
     "a node in the middle of an edge or face of one element is something else in another"},
    {"CHUNK_OUT_OF_ORDER", server, invalid_argument, failed, "array, offset_bytes",
     "a chunk does not continue its array"},
    {"ARRAY_SIZE_MISMATCH", server, invalid_argument, bad_mesh, "array, offset_bytes",
     "an array does not have the announced size"},
    {"INDEX_OUT_OF_RANGE", server, invalid_argument, bad_mesh, "element, node",
     "an element has a node index that does not exist"},
    {"REPEATED_NODE", server, invalid_argument, bad_mesh, "element, node",
     "an element has a node twice"},
    {"REFERENCE_FLAT", server, invalid_argument, bad_mesh, "",
     "every element of the reference is flat or inverted"},
    {"REFERENCE_TANGLED", server, invalid_argument, bad_mesh, "inverted_element_count, element",
     "the mesh to move has inverted or flat elements before it moves"},
    {"PRESCRIBED_TWICE", server, invalid_argument, bad_mesh, "node",
     "a node is prescribed more than once"},
    {"PRESCRIBED_AND_FIXED", server, invalid_argument, bad_mesh, "node",
     "a prescribed node is fixed too"},
    {"PAIR_HALF_PRESCRIBED", server, invalid_argument, bad_mesh, "node",
     "a prescribed node has a partner that is not"},
    {"NON_FINITE_COORDINATE", server, invalid_argument, bad_mesh, "node",
     "a coordinate is infinite or not a number"},
    {"FACET_OVERUSED", server, invalid_argument, bad_mesh, "facet_nodes",
     "a facet of a volume mesh belongs to more than two elements"},
    {"MESH_TANGLED", server, invalid_argument, bad_mesh, "inverted_element_count",
     "inverted elements, and the caller asked to refuse them"},
    {"NON_FINITE_RESULT", server, invalid_argument, failed, "",
     "positions left the range of the coordinate type"},
    {"CHECKSUM_MISMATCH", server, data_loss, failed, "array, offset_bytes",
     "a chunk arrived damaged", "once, from the start"},
    {"BACKEND_NOT_AVAILABLE", server, failed_precondition, refused, "field",
     "the backend does not exist here, or the server runs another"},
    {"JOB_NOT_FINISHED", server, failed_precondition, refused, "name",
     "the job must have ended for this"},
    {"JOB_NOT_FOUND", server, not_found, failed, "name",
     "no job of the caller has this name, or it is no longer retained"},
    {"RESULT_NOT_KEPT", server, not_found, failed, "name",
     "the job has ended and its result is not retained"},
    {"TOPOLOGY_NOT_FOUND", server, not_found, failed, "name",
     "no topology of the caller has this name, or it was evicted", "once, inline"},
    {"REGION_NOT_FOUND", server, not_found, failed, "name",
     "no region of the caller has this name, or its lease has ended", "once, in chunks"},
    {"REQUEST_ID_REUSED", server, already_exists, refused, "field, name",
     "another job of the caller has this request id"},
    {"RESULT_OFFSET_PAST_END", server, out_of_range, failed, "size_bytes",
     "the result is shorter than the offset"},
    {"REGION_OUT_OF_RANGE", server, out_of_range, failed, "array, offset_bytes, size_bytes",
     "an array does not lie within its region"},
    {"TOKEN_MISSING", server, unauthenticated, refused, "", "the server asks for a token",
     "with a token"},
    {"TOKEN_UNKNOWN", server, unauthenticated, refused, "", "the server does not know the token",
     "with another token"},
    {"QUOTA_EXCEEDED", server, resource_exhausted, refused, "limit_jobs, limit_bytes",
     "the quota of the caller or of its connection is exceeded",
     "yes, when a job of the caller has ended", milliseconds(1000)},
    {"QUEUE_FULL", server, resource_exhausted, refused, "queued_jobs, queued_bytes",
     "the queue is full", "yes, after the delay"},
    {"HOST_MEMORY_BUSY", server, resource_exhausted, refused, "need_bytes, free_bytes",
     "other jobs use the host's memory", "yes, after the delay", milliseconds(1000)},
    {"DEVICE_MEMORY_BUSY", server, resource_exhausted, refused, "need_bytes, free_bytes",
     "other jobs use the device's memory", "yes, after the delay"},
    {"MESH_TOO_LARGE", server, resource_exhausted, refused, "need_bytes, limit_bytes, space",
     "the job never fits this server"},
    {"HOST_MEMORY_EXHAUSTED", server, resource_exhausted, refused, "",
     "the host ran out of memory during the job"},
    {"DEVICE_MEMORY_EXHAUSTED", server, resource_exhausted, refused, "",
     "the device ran out of memory during the job"},
    {"DEADLINE_IN_QUEUE", server, deadline_exceeded, stopped, "",
     "the call's deadline passed in the queue", "the caller decides"},
    {"QUEUE_TIMEOUT", server, deadline_exceeded, stopped, "",
     "the job waited longer than its queue timeout", "the caller decides"},
    {"RUN_TIMEOUT", server, deadline_exceeded, stopped, "",
     "the job ran longer than the server allows", "the caller decides"},
    {"DEADLINE_RUNNING", server, deadline_exceeded, stopped, "",
     "the call's deadline passed during the job", "the caller decides"},
    {"STREAM_IDLE", server, deadline_exceeded, stopped, "",
     "the client neither sent nor read for too long", "the caller decides"},
    {"UPLOAD_TOO_SLOW", server, deadline_exceeded, stopped, "",
     "the upload was slower than the server's minimum rate", "the caller decides"},
    {"CANCELLED_BY_CLIENT", server, cancelled, stopped, "",
     "the last call that waited for the job ended"},
    {"CANCELLED_BY_JOB_CALL", server, cancelled, stopped, "", "CancelJob ended the job"},
    {"DRAINING", server, unavailable, refused, "", "the server is shutting down", "yes, elsewhere",
     milliseconds(0)},
    {"DEVICE_LOST", server, unavailable, refused, "", "the device failed; its lane is gone",
     "yes, elsewhere", milliseconds(0)},
    {"DEVICE_REFUSED", server, unavailable, refused, "", "the device or its driver refused to work",
     "yes, elsewhere", milliseconds(0)},
    {"UPLOAD_LOST", server, unavailable, refused, "",
     "the call that sent the mesh ended before it was complete", "yes, at once", milliseconds(0)},
    {"INTERNAL", server, internal, failed, "incident",
     "the server failed; its log names the incident too"},
    {"RESPONSE_NOT_UNDERSTOOD", client, data_loss, refused, "",
     "an answer of a newer server that this client cannot read"},
    {"OPTION_MISPLACED", client, invalid_argument, usage, "",
     "a flag that the chosen method or command does not have"},
    {"REFERENCE_DIFFERS", client, invalid_argument, bad_mesh, "field",
     "a reference has other elements than the mesh"},
    {"FIXED_NODES_INVALID", client, invalid_argument, usage, "",
     "a file of fixed nodes that is not one"},
    {"FORMAT_UNKNOWN", client, invalid_argument, usage, "", "no file format has this extension"},
    {"CREDENTIALS_UNUSABLE", client, invalid_argument, usage, "",
     "a certificate, key or token that cannot be used"},
    {"NAME_UNKNOWN", client, invalid_argument, usage, "",
     "the file has no set or array of this name"},
    {"PERIODIC_MISMATCH", client, invalid_argument, usage, "",
     "no translation or rotation takes one periodic side to the other"},
    {"METRIC_UNDEFINED", client, invalid_argument, usage, "",
     "a requirement on a metric that no element of the mesh has"},
    {"ARRAY_NOT_WHOLE", client, invalid_argument, usage, "",
     "an array of regions that are not whole numbers"},
    {"ELEMENT_NOT_SUPPORTED", client, invalid_argument, bad_mesh, "",
     "an element type that is not supported"},
    {"ARRAYS_NOT_SUPPORTED", client, invalid_argument, usage, "",
     "a file format without cell arrays"},
    {"FORMAT_ERROR", client, invalid_argument, bad_mesh, "", "a file that breaks its format"},
    {"FILE_TRUNCATED", client, invalid_argument, bad_mesh, "", "a file that ends too early"},
    {"FILE_NOT_FOUND", client, not_found, failed, "", "no such file"},
    {"FILE_NOT_READABLE", client, failed_precondition, failed, "", "a file that cannot be read"},
    {"FILE_NOT_WRITABLE", client, failed_precondition, failed, "", "a file that cannot be written"},
    {"GENERATOR_FAILED", client, internal, failed, "", "a mesh generator gave up"},
};

/// By the number of a code; 0 is gRPC's OK.
constexpr std::string_view kStatusCodeNames[] = {
    "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
    "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
    "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
    "DATA_LOSS", "UNAUTHENTICATED"};
static_assert(std::size(kStatusCodeNames) == static_cast<std::size_t>(unauthenticated) + 1);

}  // namespace

std::span<const ErrorReason> error_reasons() { return kReasons; }

const ErrorReason* find_error_reason(std::string_view name) {
  const auto* found = std::ranges::find(kReasons, name, &ErrorReason::name);
  return found == std::end(kReasons) ? nullptr : found;
}

std::string_view status_code_name(StatusCode code) {
  return kStatusCodeNames[static_cast<std::size_t>(code)];
}

}  // namespace meshsmooth
