#include "smooth_call.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <utility>

#include "request_id.hpp"
#include "service_error.hpp"
#include "wire/codec.hpp"
#include "wire/mesh_layout.hpp"

namespace meshsmooth::client {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays travel as they lie in memory");

/// With generated messages larger chunks only leave the caches (measured).
constexpr std::size_t kChunkBytes = 256 * 1024;

std::size_t size_bytes(const Mesh& mesh) {
  std::size_t bytes = mesh.fixed.size() + std::as_bytes(std::span(mesh.regions)).size();
  bytes += std::visit([](const auto& positions) { return std::as_bytes(std::span(positions)); },
                      mesh.positions)
               .size();
  for (const ElementBlock& block : mesh.blocks) bytes += block.nodes.size() * sizeof(NodeId);
  return bytes;
}

v1::BackendKind encode_backend(const std::string& backend) {
  if (backend == "auto") return v1::BACKEND_KIND_UNSPECIFIED;
  if (backend == "cpu") return v1::BACKEND_KIND_CPU;
  if (backend == "cuda") return v1::BACKEND_KIND_CUDA;
  throw ServiceError(StatusCode::invalid_argument, "OPTION_OUT_OF_RANGE",
                     "backend \"" + backend + "\" is none of auto, cpu, cuda",
                     {{"field", "backend_kind"}}, {});
}

}  // namespace

std::chrono::nanoseconds default_timeout(const Mesh& mesh, const SmoothOptions& options) {
  constexpr double kSecondsPerByte = 1e-6;
  constexpr double kSecondsPerElementAndSweep = 10e-6;
  constexpr double kWeek = 7 * 24 * 3600.0;
  const double seconds = 600 + kSecondsPerByte * static_cast<double>(size_bytes(mesh)) +
                         kSecondsPerElementAndSweep * static_cast<double>(mesh.element_count()) *
                             std::max(options.max_iterations, 0);
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(std::min(seconds, kWeek)));
}

JobProgress decode_progress(const v1::Progress& message) {
  JobProgress progress;
  progress.state = v1::State_IsValid(message.state()) ? static_cast<JobState>(message.state())
                                                      : JobState::unspecified;
  progress.queue_position = message.queue_position();
  if (message.stage() != v1::STAGE_UNSPECIFIED && v1::Stage_IsValid(message.stage())) {
    progress.stage = v1::Stage_Name(message.stage()).substr(std::string("STAGE_").size());
    std::transform(progress.stage.begin(), progress.stage.end(), progress.stage.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  }
  progress.iteration = message.iteration();
  progress.max_displacement = message.max_displacement();
  progress.rms_displacement = message.rms_displacement();
  return progress;
}

SmoothCall::SmoothCall(v1::SmoothingService::StubInterface& stub, std::string server, Mesh& mesh,
                       const SmoothOptions& options, const RequestOptions& request,
                       TopologyUse topology)
    : stub_(stub),
      server_(std::move(server)),
      mesh_(mesh),
      options_(options),
      request_(request),
      topology_(std::move(topology)),
      request_id_(request.request_id.empty() ? make_request_id() : request.request_id),
      timeout_(request.timeout.value_or(default_timeout(mesh, options))),
      result_(mesh) {}

SmoothReport SmoothCall::run() {
  const v1::JobSpec spec = make_spec();
  context_.set_deadline(std::chrono::system_clock::now() +
                        std::chrono::duration_cast<std::chrono::system_clock::duration>(timeout_));
  if (!topology_.route.empty()) context_.AddMetadata(kRouteKey, topology_.route);
  const std::stop_callback cancel_on_stop(request_.stop, [this] { context_.TryCancel(); });
  stream_ = stub_.Smooth(&context_);

  v1::SmoothRequest first;
  *first.mutable_spec() = spec;
  stream_->Write(first);  // when it fails, so does the first read
  try {
    converse();
  } catch (...) {
    context_.TryCancel();
    for (v1::SmoothResponse dropped; stream_->Read(&dropped);) {
    }
    if (uploader_.joinable()) uploader_.join();
    stream_->Finish();
    throw;
  }
  if (uploader_.joinable()) uploader_.join();
  const grpc::Status status = stream_->Finish();
  if (!status.ok()) {
    const double seconds = std::chrono::duration<double>(timeout_).count();
    throw to_service_error(status, {.server = server_,
                                    .cancelled_by_caller = request_.stop.stop_requested(),
                                    .timeout_seconds = seconds,
                                    .answered = !job_name_.empty()});
  }
  if (!summary_) throw broken_answer("the server ended the call without a summary");
  SmoothReport report = decode_report(*summary_, job_name_, request_id_);
  mesh_.positions = result_.take();
  return report;
}

v1::JobSpec SmoothCall::make_spec() const {
  v1::JobSpec spec;
  spec.set_request_id(request_id_);
  if (topology_.name.empty()) {
    *spec.mutable_inline_topology() = wire::encode_topology_spec(MeshTopology(mesh_).view());
    spec.set_topology_kept(topology_.kept);
  } else {
    spec.set_topology_name(topology_.name);
  }
  spec.set_coordinate_type(std::holds_alternative<std::vector<Vec3d>>(mesh_.positions)
                               ? v1::SCALAR_TYPE_FLOAT64
                               : v1::SCALAR_TYPE_FLOAT32);
  *spec.mutable_options() = wire::encode_options(options_);
  spec.set_backend_kind(encode_backend(request_.backend));
  if (request_.on_progress) {
    *spec.mutable_progress_interval() = wire::encode_duration(request_.progress_interval);
  }
  if (request_.result_ttl) {
    *spec.mutable_result_ttl() = wire::encode_duration(*request_.result_ttl);
  }
  spec.set_iteration_history_included(options_.history);
  if (options_.judgement == Judgement::brief) spec.set_quality_detail(v1::QUALITY_DETAIL_BRIEF);
  return spec;
}

void SmoothCall::converse() {
  for (v1::SmoothResponse response; stream_->Read(&response);) handle(response);
}

void SmoothCall::handle(const v1::SmoothResponse& response) {
  switch (response.message_case()) {
    case v1::SmoothResponse::kAccepted:
      return accept(response.accepted());
    case v1::SmoothResponse::kProgress:
      if (request_.on_progress) request_.on_progress(decode_progress(response.progress()));
      return;
    case v1::SmoothResponse::kResult:
      return result_.begin(response.result());
    case v1::SmoothResponse::kChunk:
      return result_.add(response.chunk());
    case v1::SmoothResponse::kSummary:
      summary_ = response.summary();
      return;
    case v1::SmoothResponse::kStopSending:
      return stop_sending();
    case v1::SmoothResponse::MESSAGE_NOT_SET:
      return;  // something a newer server adds
  }
}

void SmoothCall::accept(const v1::Accepted& accepted) {
  if (uploader_.joinable()) throw broken_answer("the server accepted the job twice");
  job_name_ = accepted.job().name();
  if (!sending_stopped_) uploader_ = std::jthread([this] { upload(); });
}

void SmoothCall::stop_sending() {
  if (sending_stopped_.exchange(true)) return;
  if (!uploader_.joinable()) stream_->WritesDone();  // else the uploader says it
}

void SmoothCall::upload() {
  std::vector<std::span<const std::byte>> elements;
  for (const ElementBlock& block : mesh_.blocks) {
    elements.push_back(std::as_bytes(std::span(block.nodes)));
  }
  const std::array fixed = {std::as_bytes(std::span(mesh_.fixed))};
  const std::array tags = {std::as_bytes(std::span(mesh_.regions))};
  const std::array coordinates = {
      std::visit([](const auto& positions) { return std::as_bytes(std::span(positions)); },
                 std::as_const(mesh_.positions))};
  const bool sends_topology = topology_.name.empty();
  const bool connected = (!sends_topology || (upload_array(v1::ARRAY_ID_ELEMENTS, elements) &&
                                              upload_array(v1::ARRAY_ID_FIXED_MASK, fixed) &&
                                              upload_array(v1::ARRAY_ID_ELEMENT_TAGS, tags))) &&
                         upload_array(v1::ARRAY_ID_COORDINATES, coordinates);
  if (connected) stream_->WritesDone();
}

/// False when the call has ended; true also when the server wants no more.
bool SmoothCall::upload_array(v1::ArrayId id, std::span<const std::span<const std::byte>> parts) {
  v1::SmoothRequest request;
  v1::Chunk& chunk = *request.mutable_chunk();
  chunk.set_array_id(id);
  std::int64_t offset = 0;
  for (std::span<const std::byte> rest : parts) {
    while (!rest.empty() && !sending_stopped_) {
      const std::size_t size = std::min(rest.size(), kChunkBytes);
      chunk.set_offset_bytes(offset);
      chunk.set_data(rest.data(), size);
      if (!stream_->Write(request)) return false;
      offset += static_cast<std::int64_t>(size);
      rest = rest.subspan(size);
    }
  }
  return true;
}

SmoothReport decode_report(const v1::Summary& summary, const std::string& job_name,
                           const std::string& request_id) {
  SmoothReport report;
  try {
    report.summary = wire::decode_summary(summary);
  } catch (const Error& error) {
    throw broken_answer("the summary cannot be understood: " + std::string(error.what()));
  }
  report.job_name = job_name;
  report.request_id = request_id;
  report.queue_seconds = wire::decode_seconds(summary.timings().queue());
  report.receive_seconds = wire::decode_seconds(summary.timings().receive());
  report.send_seconds = wire::decode_seconds(summary.timings().send());
  report.topology_reused = summary.execution().topology_reused();
  report.server_version = summary.execution().server_version();
  report.json = wire::to_json(summary);
  return report;
}

}  // namespace meshsmooth::client
