#include "smooth_call.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "request_id.hpp"
#include "retry.hpp"
#include "service_error.hpp"
#include "wire/codec.hpp"
#include "wire/mesh_layout.hpp"
#include "wire/traceparent.hpp"

namespace meshsmooth::client {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays travel as they lie in memory");

/// Smaller ones cost more CPU, larger ones only leave the caches (measured).
constexpr std::size_t kChunkBytes = 1 << 20;

// What has happened on the stream.
void* const kRead = reinterpret_cast<void*>(1);
void* const kWritten = reinterpret_cast<void*>(2);
void* const kFinished = reinterpret_cast<void*>(3);

std::size_t size_bytes(const Mesh& mesh) {
  std::size_t bytes = mesh.fixed.size() + std::as_bytes(std::span(mesh.regions)).size();
  bytes += bytes_of(mesh.positions_view()).size();
  for (const ElementBlock& block : mesh.blocks) bytes += block.nodes.size() * sizeof(NodeId);
  return bytes;
}

v1::BackendKind encode_backend(const std::string& backend) {
  const auto name = parse_backend_name(backend);
  if (name && !name->device) return wire::encode_enum(name->kind);
  throw ServiceError(StatusCode::invalid_argument, "OPTION_OUT_OF_RANGE",
                     "backend \"" + backend + "\" is not one of " + backend_name_list(false),
                     {{"field", "backend_kind"}}, {});
}

/// See RequestOptions::timeout.
std::chrono::nanoseconds default_timeout(const Mesh& mesh, const SmoothOptions& options) {
  constexpr double kSecondsPerByte = 1e-6;
  constexpr double kSecondsPerElementAndSweep = 10e-6;
  constexpr double kWeek = 7 * 24 * 3600.0;
  const double seconds = 600 + kSecondsPerByte * static_cast<double>(size_bytes(mesh)) +
                         kSecondsPerElementAndSweep * static_cast<double>(mesh.element_count()) *
                             std::max(iteration_limit(options), 0);
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(std::min(seconds, kWeek)));
}

}  // namespace

RequestOptions completed(RequestOptions request, const Mesh& mesh, const SmoothOptions& options) {
  if (request.request_id.empty()) request.request_id = make_request_id();
  if (!request.timeout) request.timeout = default_timeout(mesh, options);
  if (!request.traceparent.empty() && !wire::is_traceparent(request.traceparent)) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "traceparent: must have the format of W3C Trace Context, "
                        "00-<32 hex digits>-<16 hex digits>-<2 hex digits>",
                        {{"field", "traceparent"}});
  }
  return request;
}

namespace {

bool moves(const SmoothOptions& options) { return is_motion(options.method); }

bool has_cotangents(const SmoothOptions& options) {
  return derivative_of(options.method) == Derivative::cotangent;
}

/// Further vectors of a job: where `Move` shall bring nodes or their tangents, cotangents, or the
/// reference.
const PositionsView& further_positions(const JobMesh& job, const SmoothOptions& options) {
  if (has_cotangents(options)) return job.input.cotangent;
  return moves(options) ? job.input.prescribed.positions : job.input.reference;
}

/// The same in the job's precision, if they come in the other one.
Positions converted_positions(const JobMesh& job, const SmoothOptions& options) {
  return std::visit(
      []<class Real, class Other>(std::span<const Vec3<Real>>,
                                  std::span<const Vec3<Other>> given) -> Positions {
        std::vector<Vec3<Real>> converted;
        if constexpr (!std::is_same_v<Real, Other>) {
          converted.reserve(given.size());
          for (const Vec3<Other>& p : given) converted.push_back(vec3_cast<Real>(p));
        }
        return converted;
      },
      job.positions, further_positions(job, options));
}

}  // namespace

SmoothCall::SmoothCall(const CallTarget& target, const JobMesh& job, const SmoothOptions& options,
                       const RequestOptions& request, Attempt attempt, Positions& memory)
    : server_(target.server),
      job_(job),
      mesh_(job.mesh),
      positions_(job.positions),
      options_(options),
      request_(request),
      topology_(std::move(attempt.topology)),
      left_(attempt.left),
      stub_(target.channel),
      converted_(converted_positions(job_, options)),
      to_send_(parts_to_send()),
      early_bytes_(attempt.early_bytes),
      result_(job.positions, job.mesh.element_count()),
      memory_(memory) {}

SmoothReport SmoothCall::run() {
  v1::SmoothRequest first;
  *first.mutable_spec() = make_spec();
  first.mutable_spec()->MergeFrom(of_transfer_);
  context_.set_deadline(time_after<std::chrono::system_clock>(left_));
  if (!topology_.route.empty()) context_.AddMetadata(kRouteKey, topology_.route);
  if (!request_.traceparent.empty()) context_.AddMetadata("traceparent", request_.traceparent);
  const std::stop_callback cancel_on_stop(request_.stop, [this] { context_.TryCancel(); });
  const grpc::Status status = converse(first);
  if (!status.ok()) {
    const double seconds = std::chrono::duration<double>(*request_.timeout).count();
    throw to_service_error(status, {.server = server_,
                                    .cancelled_by_caller = request_.stop.stop_requested(),
                                    .timeout_seconds = seconds,
                                    .answered = !job_name_.empty()});
  }
  if (!summary_) throw broken_answer("the server ended the call without a summary");
  if (in_place_) result_.add_behind_positions(transfer_->download());
  SmoothReport report = decode_report(std::move(*summary_), job_name_, request_.request_id);
  if (!in_place_) memory_ = result_.take();
  report.summary.element_quality = result_.take_element_quality();
  return report;
}

v1::JobSpec SmoothCall::make_spec() const {
  v1::JobSpec spec;
  spec.set_request_id(request_.request_id);
  if (topology_.name.empty()) {
    *spec.mutable_inline_topology() = wire::encode_topology_spec(MeshTopology(mesh_).view());
    spec.set_topology_kept(topology_.kept);
    if (moves(options_)) {
      spec.mutable_inline_topology()->set_reference_type(wire::encode_position_type(positions_));
    }
  } else {
    spec.set_topology_name(topology_.name);
  }
  spec.set_coordinate_type(wire::encode_position_type(positions_));
  spec.set_prescribed_node_count(static_cast<std::int64_t>(job_.input.prescribed.nodes.size()));
  spec.set_node_pair_count(static_cast<std::int64_t>(job_.input.node_pairs.size()));
  if (const SurfaceMesh* const given = job_.input.surface; given != nullptr) {
    v1::SurfaceSpec* const surface = spec.mutable_surface();
    surface->set_point_count(static_cast<std::int64_t>(given->points.size()));
    surface->set_triangle_count(static_cast<std::int64_t>(given->triangles.size()));
    surface->set_patches_present(!given->patches.empty());
  }
  *spec.mutable_options() = wire::encode_options(options_);
  spec.set_backend_kind(encode_backend(request_.backend));
  if (request_.on_progress) {
    *spec.mutable_progress_interval() = wire::encode_duration(request_.progress_interval);
  }
  if (request_.result_ttl) {
    *spec.mutable_result_ttl() = wire::encode_duration(*request_.result_ttl);
  }
  spec.set_iteration_history_included(options_.history);
  if (options_.quality_detail == QualityDetail::brief)
    spec.set_quality_detail(v1::QUALITY_DETAIL_BRIEF);
  for (const QualityMetric metric : options_.element_quality_metrics) {
    spec.add_element_quality_metrics(wire::encode_enum(metric));
  }
  return spec;
}

grpc::Status SmoothCall::converse(const v1::SmoothRequest& first) {
  context_.set_initial_metadata_corked(true);  // it goes with the spec
  stream_ = stub_.PrepareCall(&context_, "/meshsmooth.v1.SmoothingService/Smooth", &events_);
  stream_->StartCall(nullptr);
  writing_ = true;
  half_closed_ = transfer_ != nullptr;  // the spec is all
  if (half_closed_) {
    stream_->WriteLast(wire::encode(first), {}, kWritten);
  } else {
    // It need not go before the first chunk. When it fails, so does the first read.
    stream_->Write(wire::encode(first), grpc::WriteOptions().set_buffer_hint(), kWritten);
  }
  grpc::ByteBuffer response;
  stream_->Read(&response, kRead);

  grpc::Status status;
  std::exception_ptr error;  // from here on only the end is waited for
  void* event = nullptr;
  for (bool ok = false; events_.Next(&event, &ok);) {
    const bool answered = event == kRead && ok;
    if (event == kWritten) {
      writing_ = false;
      half_closed_ |= !ok;  // the call has ended: a read will say so
    } else if (event == kFinished) {
      half_closed_ = true;
      events_.Shutdown();  // `Next` ends when a write that is under way has
    }
    try {
      if (answered && !error) handle(response);
      if (answered) response.Clear();  // not before: it may be gRPC's, with an answer in it
      if (!error) write_next();
    } catch (...) {
      error = std::current_exception();
      context_.TryCancel();
    }
    if (answered) {
      stream_->Read(&response, kRead);
    } else if (event == kRead) {
      stream_->Finish(&status, kFinished);
    }
  }
  if (error) std::rethrow_exception(error);
  return status;
}

void SmoothCall::handle(grpc::ByteBuffer& response) {
  if (const auto chunk = wire::find_chunk(response, v1::SmoothResponse::kChunkFieldNumber)) {
    return result_.add(*chunk);
  }
  v1::SmoothResponse message;
  if (!wire::parse(response, message)) {
    throw broken_answer("cannot parse the server's SmoothResponse");
  }
  handle(message);
}

void SmoothCall::handle(const v1::SmoothResponse& response) {
  switch (response.message_case()) {
    case v1::SmoothResponse::kAccepted:
      return accept(response.accepted());
    case v1::SmoothResponse::kProgress:
      if (request_.on_progress) request_.on_progress(decode_progress(response.progress()));
      return;
    case v1::SmoothResponse::kResult:
      return begin_result(response.result());
    case v1::SmoothResponse::kChunk:
      return result_.add(wire::ChunkView(response.chunk()));
    case v1::SmoothResponse::kSummary:
      summary_ = response.summary();
      return;
    case v1::SmoothResponse::kStopSending:
      return stop_sending();
    case v1::SmoothResponse::kInputTaken:
    case v1::SmoothResponse::MESSAGE_NOT_SET:
      return;  // something a newer server adds
  }
}

void SmoothCall::accept(const v1::Accepted& accepted) {
  if (std::exchange(accepted_, true)) throw broken_answer("the server accepted the job twice");
  job_name_ = accepted.job().name();
}

void SmoothCall::begin_result(const v1::ResultHeader& header) {
  result_.begin(header, std::exchange(memory_, {}));
  check_metrics();
  in_place_ = header.in_place();
  if (in_place_ && transfer_ == nullptr) {
    throw broken_answer("the server announced no chunks of the result of a job sent in chunks");
  }
}

void SmoothCall::check_metrics() const {
  if (result_.metrics() == options_.element_quality_metrics) return;
  throw ServiceError(StatusCode::invalid_argument, "OPTION_NOT_SUPPORTED",
                     "the server does not return the element_quality_metrics that were asked for; "
                     "a server that can has the feature element_quality",
                     {{"field", "element_quality_metrics"}}, {});
}

void SmoothCall::stop_sending() {
  sending_stopped_ = true;
  to_send_.clear();
}

std::vector<ArrayPart> SmoothCall::parts_to_send() const {
  std::vector<ArrayPart> parts;
  const auto add = [&](v1::ArrayId id, std::span<const std::byte> bytes,
                       std::int64_t offset_bytes = 0) {
    if (!bytes.empty()) parts.push_back({id, offset_bytes, bytes});
  };
  if (topology_.name.empty()) {
    std::int64_t offset_bytes = 0;
    for (const ElementBlock& block : mesh_.blocks) {
      const auto bytes = std::as_bytes(std::span(block.nodes));
      add(v1::ARRAY_ID_ELEMENTS, bytes, offset_bytes);
      offset_bytes += static_cast<std::int64_t>(bytes.size());
    }
    add(v1::ARRAY_ID_FIXED_MASK, std::as_bytes(std::span(mesh_.fixed)));
    add(v1::ARRAY_ID_ELEMENT_REGIONS, std::as_bytes(std::span(mesh_.regions)));
  }
  const auto add_further = [&](v1::ArrayId id) {
    const auto converted =
        std::visit([](const auto& own) { return std::as_bytes(std::span(own)); }, converted_);
    add(id, converted.empty() ? bytes_of(further_positions(job_, options_)) : converted);
  };
  if (!job_.input.node_pairs.empty()) {
    (void)hold_node_pairs(MeshTopology(mesh_).view(),
                          job_.input);  // refuses them before they travel
  }
  if (moves(options_)) {
    validate_motion(MeshTopology(mesh_).view(), options_, job_.input);
    const bool cotangents = has_cotangents(options_);
    if (topology_.name.empty()) add(v1::ARRAY_ID_REFERENCE_COORDINATES, bytes_of(positions_));
    if (cotangents) add_further(v1::ARRAY_ID_COORDINATES);
    add(v1::ARRAY_ID_PRESCRIBED_NODES, std::as_bytes(job_.input.prescribed.nodes));
    if (!cotangents) add_further(v1::ARRAY_ID_PRESCRIBED_COORDINATES);
  } else {
    add(v1::ARRAY_ID_COORDINATES, bytes_of(positions_));
    if (aims_at_reference(options_)) {
      validate_reference(MeshTopology(mesh_).view(), job_.input.reference);
      add_further(v1::ARRAY_ID_REFERENCE_COORDINATES);
    }
  }
  add(v1::ARRAY_ID_NODE_PAIRS, std::as_bytes(job_.input.node_pairs));
  if (const SurfaceMesh* const surface = job_.input.surface; surface != nullptr) {
    validate_surface(*surface);
    add(v1::ARRAY_ID_SURFACE_POINTS, std::as_bytes(std::span(surface->points)));
    add(v1::ARRAY_ID_SURFACE_TRIANGLES, std::as_bytes(std::span(surface->triangles)));
    add(v1::ARRAY_ID_SURFACE_PATCHES, std::as_bytes(std::span(surface->patches)));
  }
  std::ranges::reverse(parts);
  return parts;
}

std::size_t SmoothCall::result_bytes() const {
  return bytes_of(positions_).size() +
         options_.element_quality_metrics.size() * mesh_.element_count() * sizeof(float);
}

std::size_t SmoothCall::transfer_bytes() const {
  std::size_t bytes = result_bytes();
  for (const ArrayPart& part : to_send_) bytes += part.rest.size() + Transfer::kAlignment;
  return bytes;
}

bool SmoothCall::use(Transfer& transfer) {
  if (!transfer.upload(to_send_, result_bytes(), of_transfer_)) return false;
  to_send_.clear();
  transfer_ = &transfer;
  return true;
}

/// The next chunk, or that there are no more; beyond the first bytes once the server wants them.
void SmoothCall::write_next() {
  if (writing_ || half_closed_ || (!answered() && early_bytes_ == 0)) return;
  writing_ = true;
  if (to_send_.empty()) {
    half_closed_ = true;
    return stream_->WritesDone(kWritten);
  }
  ArrayPart& part = to_send_.back();
  const std::size_t most = answered() ? kChunkBytes : std::min(kChunkBytes, early_bytes_);
  const auto data = part.rest.first(std::min(part.rest.size(), most));
  early_bytes_ -= std::min(early_bytes_, data.size());
  const grpc::ByteBuffer chunk =
      wire::encode_chunk(v1::SmoothRequest::kChunkFieldNumber, part.id, part.offset_bytes, data);
  part.offset_bytes += static_cast<std::int64_t>(data.size());
  part.rest = part.rest.subspan(data.size());
  if (part.rest.empty()) to_send_.pop_back();
  if (!to_send_.empty()) return stream_->Write(chunk, kWritten);
  half_closed_ = true;
  stream_->WriteLast(chunk, {}, kWritten);
}

}  // namespace meshsmooth::client
