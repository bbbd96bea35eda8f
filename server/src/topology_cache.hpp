#pragma once

#include <atomic>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "memory_budget.hpp"
#include "meshsmooth/smoother.hpp"
#include "wire/mesh_assembler.hpp"

namespace meshsmooth::server {

class TopologyCache;

/// A topology that jobs can refer to by name: its arrays and, once a job has run, what the backend
/// prepared from them for the job's device. Thread-safe.
class CachedTopology {
 public:
  CachedTopology(std::string caller, std::string name, wire::MeshLayout layout,
                 std::shared_ptr<const wire::TopologyArrays> arrays, Reservation reservation)
      : caller_(std::move(caller)),
        name_(std::move(name)),
        layout_(std::move(layout)),
        reservation_(std::move(reservation)),
        arrays_(std::move(arrays)) {}

  [[nodiscard]] const std::string& caller() const { return caller_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// As announced by the upload.
  [[nodiscard]] const wire::MeshLayout& layout() const { return layout_; }
  [[nodiscard]] const std::shared_ptr<const wire::TopologyArrays>& arrays() const {
    return arrays_;
  }
  [[nodiscard]] std::int64_t resident_bytes() const;
  /// The devices whose memory holds a part of it.
  [[nodiscard]] std::vector<int> devices() const;
  /// -1: not known yet.
  [[nodiscard]] std::int64_t boundary_node_count() const;

 private:
  friend class TopologyCache;

  const std::string caller_, name_;
  const wire::MeshLayout layout_;
  // Released in reverse order: the reservations outlive the bytes.
  Reservation reservation_;
  const std::shared_ptr<const wire::TopologyArrays> arrays_;
  struct Prepared {
    std::timed_mutex building;  // held by the lane that prepares it
    Reservation reservation;
    std::shared_ptr<const PreparedTopology> topology;
  };
  mutable std::mutex mutex_;
  std::map<int, Prepared> prepared_;  // by device
  std::int64_t boundary_node_count_ = -1;
};

/// What a lane needs for a job on a cached topology.
struct PreparedForJob {
  std::shared_ptr<const PreparedTopology> topology;
  bool reused = false;  // prepared by another job
};

/// Topologies by caller and name. Unused ones are evicted, of the caller whose topologies take the
/// most memory the least recently used first, when they exceed the limit or their memory is needed.
/// Thread-safe.
class TopologyCache {
 public:
  /// The budget must outlive it.
  TopologyCache(MemoryBudget& budget, std::int64_t max_bytes)
      : budget_(budget), max_bytes_(max_bytes) {}

  /// Nothing when unknown. O(log n).
  [[nodiscard]] std::shared_ptr<CachedTopology> find(const std::string& caller,
                                                     const std::string& name);
  /// The same for a job; counts a hit or a miss.
  [[nodiscard]] std::shared_ptr<CachedTopology> find_for_job(const std::string& caller,
                                                             const std::string& name);

  /// Returns the existing one of this name, or the new one, which is cached only if there is
  /// room.
  [[nodiscard]] std::shared_ptr<CachedTopology> add(std::shared_ptr<CachedTopology> topology);

  /// Jobs that use it continue. False when unknown.
  bool remove(const std::string& caller, const std::string& name);

  /// Evicts one that no job uses; false when there is none. O(n log callers).
  bool evict_one();

  /// What `smoother`, on this device, needs for a job: prepared now, before, or by another lane
  /// in the meantime. It is kept if the budget has room. Throws what `Smoother::prepare` throws.
  [[nodiscard]] PreparedForJob prepare(CachedTopology& topology, Smoother& smoother, int device,
                                       const JobControl& control);

  [[nodiscard]] std::int64_t bytes() const;
  [[nodiscard]] std::size_t size() const;
  // Since the start: jobs whose named topology was cached, or was not; evicted topologies.
  [[nodiscard]] std::int64_t hit_count() const { return hit_count_; }
  [[nodiscard]] std::int64_t miss_count() const { return miss_count_; }
  [[nodiscard]] std::int64_t eviction_count() const { return eviction_count_; }

 private:
  using Key = std::pair<std::string, std::string>;             // caller, name
  using Recency = std::list<std::shared_ptr<CachedTopology>>;  // most recently used last

  bool make_room(std::int64_t bytes);
  /// Evicts what is idle. Nothing if there is no room all the same.
  [[nodiscard]] std::optional<Reservation> reserve(int device, MemoryEstimate bytes);
  [[nodiscard]] std::shared_ptr<CachedTopology> take_idle();

  MemoryBudget& budget_;
  const std::int64_t max_bytes_;
  mutable std::mutex mutex_;
  Recency by_use_;
  std::map<Key, Recency::iterator> by_name_;
  std::atomic<std::int64_t> hit_count_ = 0, miss_count_ = 0, eviction_count_ = 0;
};

}  // namespace meshsmooth::server
