#pragma once

#include <grpcpp/client_context.h>

#include <chrono>
#include <cstddef>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "transport/leased_segment.hpp"

namespace meshsmooth::client {

/// Segments for the jobs of a client, kept from job to job: a new one takes longer to make than a
/// mesh takes to send. So a thread makes it while the first job goes in chunks, and gives up those
/// that the server recalls. Never fails: where there is no shared memory there are no segments.
/// Thread-safe.
class SegmentPool {
 public:
  /// A segment for one job. Given up in the end unless it is `keep`-ed: the server may still write
  /// to the segment of a job that did not end well.
  class Borrowed {
   public:
    Borrowed() = default;
    Borrowed(SegmentPool& pool, std::unique_ptr<LeasedSegment> segment)
        : pool_(&pool), segment_(std::move(segment)) {}
    [[nodiscard]] LeasedSegment* get() const { return segment_.get(); }
    void keep() {
      if (segment_) pool_->give_back(std::move(segment_));
    }

   private:
    SegmentPool* pool_ = nullptr;
    std::unique_ptr<LeasedSegment> segment_;
  };

  /// The stub must outlive it.
  explicit SegmentPool(v1::SmoothingService::Stub& stub);
  ~SegmentPool();
  SegmentPool(const SegmentPool&) = delete;
  SegmentPool& operator=(const SegmentPool&) = delete;

  /// A segment of so many bytes; nothing when there is none now, which has one made.
  [[nodiscard]] Borrowed borrow(std::size_t bytes);

 private:
  using Clock = std::chrono::steady_clock;

  void give_back(std::unique_ptr<LeasedSegment> segment);
  void run();
  [[nodiscard]] std::unique_ptr<LeasedSegment> make(std::size_t bytes);

  v1::SmoothingService::Stub& stub_;
  const wire::Descriptor wake_, stop_;  // become readable
  std::mutex mutex_;
  std::vector<std::unique_ptr<LeasedSegment>> idle_;
  std::size_t wanted_bytes_ = 0;  // of the segment to make next; 0: none
  Clock::time_point next_try_;
  bool stopped_ = false;
  grpc::ClientContext* leasing_ = nullptr;  // the call under way
  std::thread thread_;                      // started by the first job
};

}  // namespace meshsmooth::client
