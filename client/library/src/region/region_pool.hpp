#pragma once

#include <grpcpp/client_context.h>

#include <chrono>
#include <cstddef>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "region/leased_region.hpp"

namespace meshsmooth::client {

/// Regions for the jobs of a client, kept from job to job: a new one takes longer to make than a
/// mesh takes to send. So a thread makes it while the first job goes in chunks, and gives up those
/// that the server wants back. Never fails: where there is no shared memory there are no regions.
/// Thread-safe.
class RegionPool {
 public:
  /// A region for one job. Given up in the end unless it is `keep`-ed: the server may still write
  /// to the region of a job that did not end well.
  class Borrowed {
   public:
    Borrowed() = default;
    Borrowed(RegionPool& pool, std::unique_ptr<LeasedRegion> region)
        : pool_(&pool), region_(std::move(region)) {}
    [[nodiscard]] LeasedRegion* get() const { return region_.get(); }
    void keep() {
      if (region_) pool_->give_back(std::move(region_));
    }
    void give_up() { region_.reset(); }

   private:
    RegionPool* pool_ = nullptr;
    std::unique_ptr<LeasedRegion> region_;
  };

  /// The stub must outlive it.
  explicit RegionPool(v1::SmoothingService::Stub& stub);
  ~RegionPool();
  RegionPool(const RegionPool&) = delete;
  RegionPool& operator=(const RegionPool&) = delete;

  /// A region of so many bytes; nothing when there is none now, which has one made.
  [[nodiscard]] Borrowed borrow(std::size_t bytes);

 private:
  using Clock = std::chrono::steady_clock;

  void give_back(std::unique_ptr<LeasedRegion> region);
  void run();
  [[nodiscard]] std::unique_ptr<LeasedRegion> make(std::size_t bytes);

  v1::SmoothingService::Stub& stub_;
  const wire::Descriptor wake_, stop_;  // become readable
  std::mutex mutex_;
  std::vector<std::unique_ptr<LeasedRegion>> idle_;
  std::size_t wanted_bytes_ = 0;  // of the region to make next; 0: none
  Clock::time_point next_try_;
  bool stopped_ = false;
  grpc::ClientContext* leasing_ = nullptr;  // the call under way
  std::thread thread_;                      // started by the first job
};

}  // namespace meshsmooth::client
