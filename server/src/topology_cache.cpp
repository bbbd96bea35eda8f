#include "topology_cache.hpp"

#include <algorithm>
#include <chrono>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {

std::int64_t CachedTopology::resident_bytes() const {
  const std::lock_guard lock(mutex_);
  std::int64_t bytes = arrays_->size_bytes();
  for (const auto& [device, prepared] : prepared_) {
    const MemoryEstimate held = prepared.reservation.bytes();
    bytes += held.host_bytes + held.device_bytes;
  }
  return bytes;
}

std::vector<int> CachedTopology::devices() const {
  const std::lock_guard lock(mutex_);
  std::vector<int> devices;
  for (const auto& [device, prepared] : prepared_) {
    if (prepared.reservation.bytes().device_bytes > 0) devices.push_back(device);
  }
  return devices;
}

std::int64_t CachedTopology::boundary_node_count() const {
  const std::lock_guard lock(mutex_);
  return boundary_node_count_;
}

std::shared_ptr<CachedTopology> TopologyCache::find(const std::string& caller,
                                                    const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto found = by_name_.find({caller, name});
  if (found == by_name_.end()) return nullptr;
  by_use_.splice(by_use_.end(), by_use_, found->second);
  return *found->second;
}

std::shared_ptr<CachedTopology> TopologyCache::find_for_job(const std::string& caller,
                                                            const std::string& name) {
  auto topology = find(caller, name);
  ++(topology ? hit_count_ : miss_count_);
  return topology;
}

std::shared_ptr<CachedTopology> TopologyCache::add(std::shared_ptr<CachedTopology> topology) {
  if (auto present = find(topology->caller(), topology->name())) return present;
  if (!make_room(topology->resident_bytes())) return topology;
  const std::lock_guard lock(mutex_);
  const auto [place, is_new] =
      by_name_.emplace(Key(topology->caller(), topology->name()), by_use_.end());
  if (is_new) place->second = by_use_.insert(by_use_.end(), topology);
  return *place->second;
}

bool TopologyCache::remove(const std::string& caller, const std::string& name) {
  std::shared_ptr<CachedTopology> removed;  // destroyed without the lock
  const std::lock_guard lock(mutex_);
  const auto found = by_name_.find({caller, name});
  if (found == by_name_.end()) return false;
  removed = *found->second;
  by_use_.erase(found->second);
  by_name_.erase(found);
  return true;
}

std::shared_ptr<CachedTopology> TopologyCache::take_idle() {
  const std::lock_guard lock(mutex_);
  std::map<std::string, std::int64_t> bytes_of;  // by caller
  for (const auto& topology : by_use_) bytes_of[topology->caller()] += topology->resident_bytes();
  auto idle = by_use_.end();
  for (auto topology = by_use_.begin(); topology != by_use_.end(); ++topology) {
    if (topology->use_count() != 1) continue;
    if (idle == by_use_.end() || bytes_of[(*topology)->caller()] > bytes_of[(*idle)->caller()]) {
      idle = topology;
    }
  }
  if (idle == by_use_.end()) return nullptr;
  std::shared_ptr<CachedTopology> taken = *idle;
  by_name_.erase({taken->caller(), taken->name()});
  by_use_.erase(idle);
  ++eviction_count_;
  return taken;
}

bool TopologyCache::evict_one() { return take_idle() != nullptr; }

bool TopologyCache::make_room(std::int64_t bytes) {
  if (bytes > max_bytes_) return false;
  while (this->bytes() > max_bytes_ - bytes) {
    if (!evict_one()) return false;
  }
  return true;
}

std::optional<Reservation> TopologyCache::reserve(int device, MemoryEstimate bytes) {
  if (!make_room(bytes.host_bytes + bytes.device_bytes)) return std::nullopt;
  for (;;) {
    try {
      return budget_.reserve_on(device, bytes);
    } catch (const OutOfMemory& error) {
      if (error.reason() == "MESH_TOO_LARGE" || !evict_one()) return std::nullopt;
    }
  }
}

PreparedForJob TopologyCache::prepare(CachedTopology& topology, Smoother& smoother, int device,
                                      const JobControl& control) {
  CachedTopology::Prepared* place = nullptr;
  const auto present = [&] {
    const std::lock_guard lock(topology.mutex_);
    place = &topology.prepared_[device];
    return place->topology;
  };
  if (auto prepared = present()) return {std::move(prepared), true};

  std::unique_lock building(place->building, std::defer_lock);
  while (!building.try_lock_for(std::chrono::milliseconds(10))) {
    if (control.stop.stop_requested()) throw Cancelled("CANCELLED", "the job was cancelled");
  }
  if (auto prepared = present()) return {std::move(prepared), true};

  auto reservation = reserve(device, smoother.estimate_prepared(topology.layout().size()));
  const wire::TopologyArrays& arrays = *topology.arrays();
  PreparedForJob result{smoother.prepare(arrays.view(), control, arrays.reference())};
  if (!reservation) return result;  // used by this job only
  const MemoryEstimate bytes = result.topology->bytes(), most = reservation->bytes();
  if (bytes.host_bytes > most.host_bytes || bytes.device_bytes > most.device_bytes) {
    reservation = reserve(device, bytes);  // the mesh is not conforming
    if (!reservation) return result;
  } else {
    (void)reservation->split(
        {most.host_bytes - bytes.host_bytes, most.device_bytes - bytes.device_bytes});
  }
  const std::lock_guard lock(topology.mutex_);
  place->reservation = std::move(*reservation);
  place->topology = result.topology;
  topology.boundary_node_count_ = result.topology->boundary_node_count();
  return result;
}

std::int64_t TopologyCache::bytes() const {
  const std::lock_guard lock(mutex_);
  std::int64_t sum = 0;
  for (const auto& topology : by_use_) sum += topology->resident_bytes();
  return sum;
}

std::size_t TopologyCache::size() const {
  const std::lock_guard lock(mutex_);
  return by_use_.size();
}

}  // namespace meshsmooth::server
