#include "rpc/job_messages.hpp"

#include <google/protobuf/util/time_util.h>

#include <chrono>
#include <string>

#include "rpc/status.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::server {
namespace {

google::protobuf::Timestamp encode_time(std::chrono::system_clock::time_point time) {
  return google::protobuf::util::TimeUtil::NanosecondsToTimestamp(
      std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count());
}

v1::JobError encode_error(const std::exception_ptr& error, const std::string& incident) {
  const wire::StatusDetails details = describe_error(error, incident);
  v1::JobError message;
  message.set_code(details.code);
  message.set_reason(details.reason);
  message.set_message(details.message);
  for (const auto& [key, value] : details.metadata) (*message.mutable_metadata())[key] = value;
  return message;
}

}  // namespace

v1::Progress encode_progress(const JobSnapshot& now, int queue_position) {
  v1::Progress message;
  message.set_state(wire::encode_enum(now.state));
  message.set_queue_position(queue_position);
  if (now.progress_count == 0) return message;
  message.set_stage(wire::encode_enum(now.progress.stage));
  message.set_iteration(now.progress.iteration);
  message.set_max_displacement(now.progress.max_displacement);
  message.set_rms_displacement(now.progress.rms_displacement);
  return message;
}

v1::Job encode_job(const Job& job, const Engine& engine) {
  const JobSnapshot now = job.snapshot();
  const JobRequest& request = job.request();
  v1::Job message;
  message.set_name(job.name());
  message.set_request_id(request.request_id);
  message.set_state(wire::encode_enum(now.state));
  *message.mutable_create_time() = encode_time(now.times.created);
  if (now.times.started) {
    const auto delay = std::chrono::duration_cast<std::chrono::system_clock::duration>(
        *now.times.started - now.times.admitted);
    *message.mutable_start_time() = encode_time(now.times.created + delay);
  }
  if (has_ended(now.state)) *message.mutable_end_time() = encode_time(now.times.ended_wall);
  if (request.kept() && now.summary) {
    *message.mutable_expire_time() = encode_time(now.times.expires_wall);
  }
  message.set_priority(wire::encode_enum(request.priority));
  message.set_node_count(request.layout.node_count);
  message.set_element_count(request.layout.element_count());
  message.set_queue_position(engine.queue().position(job));
  *message.mutable_last_progress() = encode_progress(now, message.queue_position());
  if (now.error) *message.mutable_error() = encode_error(now.error, job.name());
  if (now.summary) *message.mutable_summary() = encode_job_summary(job, now);
  return message;
}

v1::ResultHeader encode_result_header(const Job& job, const JobSnapshot& now, bool in_place) {
  const wire::MeshLayout& layout = job.request().layout;
  v1::ResultHeader header;
  header.set_node_count(layout.node_count);
  header.set_coordinate_type(layout.float64 ? v1::SCALAR_TYPE_FLOAT64 : v1::SCALAR_TYPE_FLOAT32);
  header.set_size_bytes(job.request().result_bytes());
  header.set_topology_name(now.topology_name);
  header.set_in_place(in_place);
  for (const QualityMetric metric : job.request().options.element_quality_metrics) {
    header.add_element_quality_metrics(wire::encode_enum(metric));
  }
  return header;
}

v1::Summary encode_job_summary(const Job& job, const JobSnapshot& now) {
  v1::Summary message = wire::encode_summary(*now.summary);
  v1::Timings* timings = message.mutable_timings();
  *timings->mutable_receive() = wire::encode_seconds(now.times.receive_seconds());
  *timings->mutable_queue() = wire::encode_seconds(now.times.queue_seconds());
  *timings->mutable_send() = wire::encode_seconds(now.times.send_seconds());
  v1::Execution* execution = message.mutable_execution();
  execution->set_host_peak_bytes(execution->host_peak_bytes() + job.request().layout.total_bytes());
  execution->set_topology_reused(now.topology_reused);
  execution->set_server_version(MESHSMOOTH_VERSION);
  *message.mutable_options() = wire::encode_options(job.request().options);
  return message;
}

}  // namespace meshsmooth::server
