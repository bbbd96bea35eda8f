#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "engine.hpp"
#include "job.hpp"
#include "meshsmooth/v1/smoothing.pb.h"
#include "rpc/transfer.hpp"

namespace meshsmooth::server {

/// The fields of a JobSpec that concern the call rather than the job.
struct CallOptions {
  std::optional<std::chrono::nanoseconds> progress_interval;  // unset: no progress
  int result_chunk_bytes = 0;
  bool validate_only = false;
  std::shared_ptr<const Transfer> transfer;
};

struct DecodedSpec {
  JobRequest job;
  CallOptions call;
};

/// Validates everything except memory. Throws InvalidMesh, InvalidOption,
/// NotSupported, OutOfMemory (MESH_TOO_LARGE).
[[nodiscard]] DecodedSpec decode_spec(const v1::JobSpec& spec, const std::string& caller,
                                      Engine& engine);

/// What an error shows of a name that a caller sent, which may be of any length.
[[nodiscard]] std::string shown_name(const std::string& name);

/// Throws Error (TOPOLOGY_NOT_FOUND).
[[nodiscard]] std::shared_ptr<CachedTopology> find_topology(Engine& engine,
                                                            const std::string& caller,
                                                            const std::string& name);
[[nodiscard]] v1::Topology encode_topology(const CachedTopology& topology);

}  // namespace meshsmooth::server
