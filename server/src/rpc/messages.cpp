#include "rpc/messages.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <span>
#include <sstream>
#include <string_view>
#include <vector>

#include "meshsmooth/error.hpp"
#include "meshsmooth/input_use.hpp"
#include "rpc/server_info.hpp"
#include "wire/codec.hpp"
#include "wire/sha256.hpp"

namespace meshsmooth::server {
namespace {

[[noreturn]] void throw_not_supported(const std::string& field, const std::string& what) {
  throw NotSupported("OPTION_NOT_SUPPORTED", field + ": " + what, {{"field", field}});
}

[[noreturn]] void throw_out_of_range(const std::string& field, const std::string& what) {
  throw InvalidOption("OPTION_OUT_OF_RANGE", field + ": " + what, {{"field", field}});
}

// The id appears in logs and answers, so it must be a UUID.
void check_request_id(const std::string& id) {
  if (id.empty()) return;
  bool is_uuid = id.size() == 36;
  for (std::size_t i = 0; is_uuid && i < id.size(); ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    is_uuid = dash ? id[i] == '-' : std::isxdigit(static_cast<unsigned char>(id[i])) != 0;
  }
  if (!is_uuid) throw_out_of_range("request_id", "not a UUID");
}

Priority decode_priority(v1::Priority priority) {
  if (priority == v1::PRIORITY_UNSPECIFIED) return Priority::normal;
  if (const auto known = wire::decode_enum<Priority>(priority)) return *known;
  throw_not_supported("priority", "unknown priority " + std::to_string(priority));
}

void check_backend(v1::BackendKind wanted, std::string_view backend) {
  if (wanted == v1::BACKEND_KIND_UNSPECIFIED ||
      wanted == wire::encode_enum(backend_of(backend).kind)) {
    return;
  }
  if (!v1::BackendKind_IsValid(wanted)) {
    throw_not_supported("backend_kind", "unknown backend " + std::to_string(wanted));
  }
  throw NotSupported("BACKEND_NOT_AVAILABLE",
                     "this server runs backend " + std::string(backend) + " only",
                     {{"field", "backend_kind"}});
}

// The jobs that are listed keep it, so no field of theirs may be long.
std::string short_form(std::string bytes) {
  constexpr std::size_t kLongest = 64;
  if (bytes.size() < kLongest) return bytes;
  wire::Sha256 sha256;
  sha256.add(std::as_bytes(std::span(bytes)));
  return sha256.finish();  // 64 digits
}

bool may_be_interactive(const std::string& caller, const std::string& callers) {
  std::istringstream names(callers);
  for (std::string name; std::getline(names, name, ',');) {
    if (name == caller || name == "all") return true;
  }
  return false;
}

// The fields that define the job, without those that only concern the call.
std::map<std::string, std::string> fields_of(v1::JobSpec spec) {
  spec.clear_progress_interval();
  spec.clear_max_result_chunk_bytes();
  clear_transfer(spec);
  const google::protobuf::Reflection* const reflection = spec.GetReflection();
  std::vector<const google::protobuf::FieldDescriptor*> set;
  reflection->ListFields(spec, &set);
  std::map<std::string, std::string> fields;
  for (const google::protobuf::FieldDescriptor* field : set) {
    v1::JobSpec alone;
    reflection->SwapFields(&spec, &alone, {field});
    fields[std::string(field->name())] = short_form(alone.SerializeAsString());
  }
  return fields;
}

void check_can_be_kept(const JobRequest& job, const ServerConfig& config) {
  if (job.result_bytes() <= config.max_kept_result_bytes) return;
  const std::string need = std::to_string(job.result_bytes());
  const std::string limit = std::to_string(config.max_kept_result_bytes);
  throw OutOfMemory("MESH_TOO_LARGE",
                    "the result has " + need + " bytes, this server keeps at most " + limit +
                        "; omit result_ttl and read the result in the call",
                    {{"field", "result_ttl"}, {"need_bytes", need}, {"limit_bytes", limit}});
}

QualityDetail decode_quality_detail(v1::QualityDetail detail) {
  if (detail == v1::QUALITY_DETAIL_UNSPECIFIED) return QualityDetail::full;
  if (const auto known = wire::decode_enum<QualityDetail>(detail)) return *known;
  throw_not_supported("quality_detail", "unknown detail " + std::to_string(detail));
}

[[noreturn]] void throw_topology_not_found(const std::string& name) {
  throw Error("TOPOLOGY_NOT_FOUND", "topology not found or no longer cached; send it inline",
              {{"name", shown_name(name)}});
}

// A topology that is kept may have one for jobs to come.
void refuse_unused_reference(const JobRequest& job, const v1::JobSpec& spec) {
  if (!spec.has_inline_topology() || spec.topology_kept()) return;
  if (!job.layout.kept_reference_float64) return;
  if (is_motion(job.options.method) || aims_at_reference(job.options)) return;
  throw_not_supported("inline_topology.reference_type",
                      "only move and optimize with the target reference use a reference, and this "
                      "topology is not kept for later jobs");
}

void decode_topology(const v1::JobSpec& spec, Engine& engine, JobRequest& job) {
  switch (spec.topology_case()) {
    case v1::JobSpec::kInlineTopology:
      job.layout =
          wire::decode_layout(spec.inline_topology(), spec.coordinate_type(), engine.mesh_limits());
      job.topology_kept = spec.topology_kept();
      return;
    case v1::JobSpec::kTopologyName:
      job.topology = engine.topologies().find_for_job(job.caller, spec.topology_name());
      if (!job.topology) throw_topology_not_found(spec.topology_name());
      job.layout =
          job.topology->layout().coordinates_only(wire::decode_float64(spec.coordinate_type()));
      return;
    case v1::JobSpec::TOPOLOGY_NOT_SET:
      throw InvalidOption("SPEC_MISSING", "inline_topology: the spec has no topology",
                          {{"field", "inline_topology"}});
  }
}

}  // namespace

std::string shown_name(const std::string& name) {
  constexpr std::size_t kLongest = 100;  // no name of ours is longer
  return name.size() <= kLongest ? name : "of " + std::to_string(name.size()) + " characters";
}

std::shared_ptr<CachedTopology> find_topology(Engine& engine, const std::string& caller,
                                              const std::string& name) {
  if (auto topology = engine.topologies().find(caller, name)) return topology;
  throw_topology_not_found(name);
}

v1::Topology encode_topology(const CachedTopology& topology) {
  v1::Topology message;
  message.set_name(topology.name());
  *message.mutable_spec() = wire::encode_topology_spec(topology.arrays()->view());
  if (const PositionsView reference = topology.arrays()->reference();
      position_count(reference) > 0) {
    message.mutable_spec()->set_reference_type(wire::encode_position_type(reference));
  }
  message.set_resident_bytes(topology.resident_bytes());
  message.set_boundary_node_count(std::max<std::int64_t>(topology.boundary_node_count(), 0));
  return message;
}

DecodedSpec decode_spec(const v1::JobSpec& spec, const std::string& caller, Engine& engine) {
  const ServerConfig& config = engine.config();
  wire::refuse_unknown_fields(spec);
  check_request_id(spec.request_id());
  check_backend(spec.backend_kind(), engine.devices().front());

  DecodedSpec decoded;
  decoded.job.caller = caller;
  decoded.job.request_id = spec.request_id();
  decoded.job.fields = fields_of(spec);
  decoded.job.options = wire::decode_options(spec.options());
  decoded.job.options.history = spec.iteration_history_included();
  decoded.job.priority = decode_priority(spec.priority());
  if (!may_be_interactive(caller, config.interactive_callers)) {
    decoded.job.priority = std::min(decoded.job.priority, Priority::normal);
  }
  decoded.job.options.quality_detail = decode_quality_detail(spec.quality_detail());
  decoded.job.options.element_quality_metrics =
      wire::decode_metrics(spec.element_quality_metrics());
  decode_topology(spec, engine, decoded.job);
  wire::MeshLayout& layout = decoded.job.layout;
  if (aims_at_reference(decoded.job.options) && !layout.kept_reference_float64) {
    layout.expect_reference(engine.mesh_limits());
  }
  refuse_unused_reference(decoded.job, spec);
  if (std::holds_alternative<Move>(decoded.job.options.method)) {
    layout.expect_prescribed(spec.prescribed_node_count(), engine.mesh_limits(),
                             derivative_of(decoded.job.options.method) == Derivative::cotangent);
  } else if (spec.prescribed_node_count() != 0) {
    throw_not_supported("prescribed_node_count", "only move takes prescribed nodes");
  }

  layout.expect_node_pairs(spec.node_pair_count(), engine.mesh_limits());
  if (spec.has_surface()) {
    layout.expect_surface(spec.surface(), engine.mesh_limits());
    validate_surface_use(decoded.job.options);
  }

  decoded.job.progress_wanted = spec.has_progress_interval();
  if (spec.has_progress_interval()) {
    decoded.call.progress_interval =
        wire::decode_duration(spec.progress_interval(), "progress_interval");
  }
  decoded.job.queue_timeout = config.max_queue_timeout;
  if (spec.has_queue_timeout()) {
    decoded.job.queue_timeout = std::min(
        *decoded.job.queue_timeout, wire::decode_duration(spec.queue_timeout(), "queue_timeout"));
  }
  if (spec.has_result_ttl()) {
    const auto ttl = wire::decode_duration(spec.result_ttl(), "result_ttl");
    if (ttl.count() == 0) throw_out_of_range("result_ttl", "it must be above 0");
    decoded.job.result_ttl = std::min(config.max_result_ttl, ttl);
    check_can_be_kept(decoded.job, config);
  }
  if (spec.max_result_chunk_bytes() < 0) throw_out_of_range("max_result_chunk_bytes", "negative");
  decoded.call.result_chunk_bytes =
      spec.max_result_chunk_bytes() == 0
          ? config.result_chunk_bytes
          : std::min(spec.max_result_chunk_bytes(), config.max_chunk_bytes);
  decoded.call.validate_only = spec.validate_only();
  decoded.call.transfer = decode_transfer(spec, engine, decoded.job);
  return decoded;
}

}  // namespace meshsmooth::server
