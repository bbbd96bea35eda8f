#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "engine.hpp"
#include "job.hpp"
#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::server {

/// What a JobSpec says of the call rather than of the job.
struct CallOptions {
  std::optional<std::chrono::nanoseconds> progress_interval;  // unset: no progress
  int result_chunk_bytes = 0;
  bool validate_only = false;
};

struct DecodedSpec {
  JobRequest job;
  CallOptions call;
};

/// Checks everything but memory. Throws InvalidMesh, InvalidOption,
/// NotSupported, OutOfMemory (MESH_TOO_LARGE).
[[nodiscard]] DecodedSpec decode_spec(const v1::JobSpec& spec, const std::string& identity,
                                      Engine& engine);

/// Throws Error (TOPOLOGY_NOT_FOUND).
[[nodiscard]] std::shared_ptr<CachedTopology> find_topology(Engine& engine,
                                                            const std::string& identity,
                                                            const std::string& name);
[[nodiscard]] v1::Topology encode_topology(const CachedTopology& topology);

[[nodiscard]] v1::Progress encode_progress(const JobSnapshot& now, int queue_position);

/// The job with all that is known of it now.
[[nodiscard]] v1::Job encode_job(const Job& job, const Engine& engine);

[[nodiscard]] v1::ResultHeader encode_result_header(const Job& job, const JobSnapshot& now);

/// The positions from `offset` on, at most so many bytes.
[[nodiscard]] std::span<const std::byte> result_chunk(const JobResult& result, std::int64_t offset,
                                                      int max_bytes);

/// Core's summary and what the server knows: waiting times, options, version.
[[nodiscard]] v1::Summary encode_job_summary(const Job& job, const JobSnapshot& now);

[[nodiscard]] v1::GetServerInfoResponse encode_server_info(const Engine& engine);

}  // namespace meshsmooth::server
