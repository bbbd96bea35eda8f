#include "rpc/server_info.hpp"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <string>

#include "rpc/transfer.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::server {
namespace {

google::protobuf::Duration encode_duration(ServerConfig::Duration duration) {
  return google::protobuf::util::TimeUtil::NanosecondsToDuration(duration.count());
}

void add_methods(v1::GetServerInfoResponse& info) {
  for_each_method([&](const auto& method) {
    info.add_methods(std::string(method_name(method)));
    *info.add_method_defaults() = wire::encode_options({.method = method});
  });
}

}  // namespace

BackendName backend_of(std::string_view device) {
  return parse_backend_name(device).value_or(BackendName{.kind = BackendKind::cpu});
}

v1::GetServerInfoResponse encode_server_info(const Engine& engine) {
  const ServerConfig& config = engine.config();
  v1::GetServerInfoResponse info;
  info.set_server_version(MESHSMOOTH_VERSION);
  info.set_build_commit(MESHSMOOTH_BUILD_COMMIT);
  info.add_api_versions("meshsmooth.v1");
  *info.mutable_default_options() = wire::encode_options(SmoothOptions{});
  add_methods(info);
  for (const ElementType type : kElementTypes) {
    info.add_element_types(wire::encode_element_type(type));
  }
  for (const char* feature :
       {"element_quality", "element_regions", "request_id_joins", "kept_results", "topology_cache",
        "kept_reference", "node_pairs", "target_surface", "move_derivative"}) {
    info.add_features(feature);
  }
  info.set_draining(engine.draining());

  v1::Limits* limits = info.mutable_limits();
  constexpr int kChunkOverhead = 1 << 10;  // of the message around it
  limits->set_max_chunk_bytes(
      std::min(config.max_chunk_bytes, config.max_receive_message_bytes - kChunkOverhead));
  limits->set_max_job_bytes(config.max_job_bytes);
  limits->set_max_node_count(config.max_node_count);
  limits->set_max_element_count(config.max_element_count);
  limits->set_max_queued_job_count(config.max_queued_jobs);
  limits->set_max_concurrent_streams(config.max_concurrent_streams);
  *limits->mutable_max_result_ttl() = encode_duration(config.max_result_ttl);
  *limits->mutable_max_queue_timeout() = encode_duration(config.max_queue_timeout);
  *limits->mutable_stream_idle_timeout() = encode_duration(config.stream_idle_timeout);
  limits->set_early_data_bytes(config.early_data_bytes);
  encode_transport(engine.transport(), info);

  const MemoryBytes limit = engine.memory_budget().limit();
  const MemoryBytes reserved = engine.memory_budget().reserved();
  for (const std::string& name : engine.devices()) {
    const int device = info.backends_size();
    v1::Backend* backend = info.add_backends();
    const BackendName parsed = backend_of(name);
    backend->set_kind(wire::encode_enum(parsed.kind));
    backend->set_name(name);
    // The memory that the backend computes in.
    const bool on_device = has_devices(parsed.kind);
    backend->set_total_bytes(on_device ? limit.device_bytes[device] : limit.host_bytes);
    backend->set_reserved_bytes(on_device ? reserved.device_bytes[device] : reserved.host_bytes);
    if (on_device) backend->set_device_index(parsed.device.value_or(0));
    for (const auto& lane : engine.lanes()) {
      if (lane->device() != device) continue;
      backend->set_lane_count(backend->lane_count() + 1);
      if (lane->busy()) backend->set_busy_lane_count(backend->busy_lane_count() + 1);
      if (lane->in_service()) backend->set_healthy(true);
    }
  }
  return info;
}

}  // namespace meshsmooth::server
