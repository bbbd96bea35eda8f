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

#include "ledger.hpp"
#include "meshsmooth/smoother.hpp"
#include "wire/mesh_assembler.hpp"

namespace meshsmooth::server {

class TopologyCache;

/// A topology that jobs can name: its arrays and, once a job has run, what the backend
/// prepared of them for the job's device. Thread-safe.
class CachedTopology {
 public:
  CachedTopology(std::string identity, std::string name, wire::MeshLayout layout,
                 std::shared_ptr<const wire::TopologyArrays> arrays, Reservation reservation)
      : identity_(std::move(identity)),
        name_(std::move(name)),
        layout_(std::move(layout)),
        reservation_(std::move(reservation)),
        arrays_(std::move(arrays)) {}

  [[nodiscard]] const std::string& identity() const { return identity_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// As it was announced.
  [[nodiscard]] const wire::MeshLayout& layout() const { return layout_; }
  [[nodiscard]] const std::shared_ptr<const wire::TopologyArrays>& arrays() const {
    return arrays_;
  }
  [[nodiscard]] std::int64_t resident_bytes() const;
  /// Those whose memory holds a part of it.
  [[nodiscard]] std::vector<int> devices() const;
  /// -1: no job has found out.
  [[nodiscard]] std::int64_t boundary_node_count() const;

 private:
  friend class TopologyCache;

  const std::string identity_, name_;
  const wire::MeshLayout layout_;
  // Given back in reverse order: the promises outlive the bytes.
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

/// What a lane takes for a job on a cached topology.
struct PreparedForJob {
  std::shared_ptr<const PreparedTopology> topology;
  bool reused = false;  // another job's work
};

/// Topologies by name, each its owner's. What no job uses goes, the least recently used
/// first, when there are too many bytes or the memory is needed. Thread-safe.
class TopologyCache {
 public:
  /// The ledger must outlive it.
  TopologyCache(Ledger& ledger, std::int64_t max_bytes) : ledger_(ledger), max_bytes_(max_bytes) {}

  /// Nothing when unknown. O(log n).
  [[nodiscard]] std::shared_ptr<CachedTopology> find(const std::string& identity,
                                                     const std::string& name);
  /// The same for a job: a hit or a miss.
  [[nodiscard]] std::shared_ptr<CachedTopology> find_for_job(const std::string& identity,
                                                             const std::string& name);

  /// The one that is there, or the new one; it stays only if there is room.
  [[nodiscard]] std::shared_ptr<CachedTopology> add(std::shared_ptr<CachedTopology> topology);

  /// Jobs that use it go on. False when unknown.
  bool remove(const std::string& identity, const std::string& name);

  /// Frees the least recently used that no job uses; false when there is none.
  bool evict_one();

  /// What `smoother`, of this device, needs for a job: prepared now, or before, or by another
  /// lane meanwhile.
  /// It is kept if the ledger has room. Throws what `Smoother::prepare` throws.
  [[nodiscard]] PreparedForJob prepare(CachedTopology& topology, Smoother& smoother, int device,
                                       const JobControl& control);

  [[nodiscard]] std::int64_t bytes() const;
  [[nodiscard]] std::size_t size() const;
  // Since the start: jobs that named a topology and got it, or not; what had to go.
  [[nodiscard]] std::int64_t hit_count() const { return hit_count_; }
  [[nodiscard]] std::int64_t miss_count() const { return miss_count_; }
  [[nodiscard]] std::int64_t eviction_count() const { return eviction_count_; }

 private:
  using Key = std::pair<std::string, std::string>;             // identity, name
  using Recency = std::list<std::shared_ptr<CachedTopology>>;  // the last used is last

  bool make_room(std::int64_t bytes);
  [[nodiscard]] std::shared_ptr<CachedTopology> take_idle();

  Ledger& ledger_;
  const std::int64_t max_bytes_;
  mutable std::mutex mutex_;
  Recency by_use_;
  std::map<Key, Recency::iterator> by_name_;
  std::atomic<std::int64_t> hit_count_ = 0, miss_count_ = 0, eviction_count_ = 0;
};

}  // namespace meshsmooth::server
