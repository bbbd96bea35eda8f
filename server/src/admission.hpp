#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <optional>
#include <string>
#include <vector>

#include "job.hpp"
#include "job_queue.hpp"
#include "job_store.hpp"
#include "memory_budget.hpp"
#include "meshsmooth/server_config.hpp"
#include "meshsmooth/smoother.hpp"
#include "topology_cache.hpp"
#include "upload_share.hpp"

namespace meshsmooth::server {

/// A call's part in a job: while it lasts, the call is notified of changes and holds the
/// memory of its stream. Returned by `Engine::leave`.
struct Subscription {
  std::shared_ptr<Job> job;
  int observer_id = 0;
  bool joined = false;  // the job belongs to another call: this one uploads no mesh
  Reservation stream;
  UploadShare stream_share = {};  // of the caller, for streams that only read
};

/// Decides whether a job may begin, and creates it: reserves its memory first, then allocates.
/// Thread-safe.
class Admission {
 public:
  /// All of these must outlive it. `smoother` estimates what jobs need on its kind of device,
  /// `memory` holds the arrays of meshes, and `end_observer` is that of every job.
  Admission(const ServerConfig& config, const Smoother& smoother, MemoryBudget& budget,
            TopologyCache& topologies, JobQueue& queue, JobStore& store,
            std::pmr::memory_resource* memory, Job::EndObserver end_observer);

  /// All that a job needs: its arrays, the smoother's own memory, buffers of
  /// the stream. Throws OutOfMemory (MESH_TOO_LARGE) when it could never fit.
  [[nodiscard]] MemoryEstimate estimate(const JobRequest& request) const;

  /// Throws InvalidOption (OPTION_OUT_OF_RANGE) where the limits leave no room for any job.
  void check_limits() const;

  /// See Smoother.
  [[nodiscard]] bool reads_positions_once(const MeshSize& size) const {
    return smoother_.reads_positions_once(size);
  }

  /// A new job, or the caller's existing one with the same request id. Throws OutOfMemory
  /// (MESH_TOO_LARGE, HOST_MEMORY_BUSY, DEVICE_MEMORY_BUSY, QUEUE_FULL, QUOTA_EXCEEDED) or Error
  /// (REQUEST_ID_REUSED: the spec of that job differs).
  [[nodiscard]] Subscription admit(const JobRequest& request, const Job::Observer& observer);

  /// A part in an existing job. Throws OutOfMemory (HOST_MEMORY_BUSY), Error (RESULT_NOT_KEPT), or
  /// why the job failed. `share`: see Caller.
  [[nodiscard]] Subscription subscribe(const std::shared_ptr<Job>& job, const std::string& share,
                                       const Job::Observer& observer);

  /// Of a stream's reservation, for what the network delivers before it is read.
  [[nodiscard]] static std::int64_t window_bytes(const ServerConfig& config);
  /// Of the arrays of a mesh's topology, as they are allocated.
  [[nodiscard]] static std::int64_t topology_bytes(const wire::MeshLayout& layout);

 private:
  [[nodiscard]] std::optional<Subscription> join(const JobRequest& request,
                                                 const Job::Observer& observer);
  /// Evicts topologies before it refuses.
  [[nodiscard]] Reservation reserve(MemoryEstimate need,
                                    const std::vector<int>& preferred_devices = {});

  const ServerConfig& config_;
  const Smoother& smoother_;
  MemoryBudget& budget_;
  TopologyCache& topologies_;
  JobQueue& queue_;
  JobStore& store_;
  std::pmr::memory_resource* const memory_;
  const Job::EndObserver end_observer_;
  const std::int64_t stream_bytes_, reader_bytes_;
  const std::string instance_;  // distinguishes job names of different runs
  UploadShares uploads_, callers_, readers_;
  std::atomic<std::int64_t> next_sequence_ = 1;
};

}  // namespace meshsmooth::server
