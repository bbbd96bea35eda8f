#pragma once

#include <optional>
#include <vector>

#include "smooth/cuda/base/lane.hpp"

namespace meshsmooth::detail {

/// The streams of a lane during one job, with marks (numbered events) and the times between them.
/// Consecutive marks without work in between share one event: recording one costs 1.4 us (H200).
class StreamMarks {
 public:
  explicit StreamMarks(CudaLane& lane) : lane_(lane) {}
  StreamMarks(const StreamMarks&) = delete;
  StreamMarks& operator=(const StreamMarks&) = delete;

  [[nodiscard]] CudaLane& lane() { return lane_; }
  /// To queue work.
  [[nodiscard]] cudaStream_t stream() {
    stream_end_.reset();
    return lane_.stream.get();
  }
  [[nodiscard]] cudaStream_t uploads() {
    uploads_end_.reset();
    return lane_.uploads.get();
  }

  std::size_t mark(const Stream& stream) {
    std::optional<std::size_t>& end = &stream == &lane_.uploads ? uploads_end_ : stream_end_;
    if (end) return *end;
    if (event_count_ == lane_.events.size()) lane_.events.emplace_back();
    lane_.events[event_count_].record(stream);
    end = event_count_++;
    return *end;
  }

  /// Later uploads wait for what is queued so far.
  void start_uploads() {
    uploads_end_.reset();
    lane_.ordering.record(lane_.stream);
    lane_.ordering.hold_up(lane_.uploads);
  }
  /// Later work waits for a mark in the stream of uploads.
  void await(std::size_t mark) {
    if (awaited_ == mark) return;
    lane_.events[mark].hold_up(lane_.stream);
    stream_end_.reset();
    awaited_ = mark;
  }
  void await_uploads() { await(mark(lane_.uploads)); }

  void synchronize() {
    lane_.stream.synchronize();
    stream_end_.reset();  // a later mark has a later time
  }
  /// Waits on the host until a mark is reached; later work may still run.
  void wait_for(std::size_t mark) {
    lane_.events[mark].synchronize();
    stream_end_.reset();
  }

  /// Adds the time from one mark to another, when `finish` is called.
  void add_interval(std::size_t begin, std::size_t end, double& seconds) {
    intervals_.push_back({begin, end, &seconds});
  }
  /// Adds the time of the work queued in its lifetime, when `finish` is called.
  class Timer {
   public:
    Timer(StreamMarks& marks, double& seconds) : marks_(marks), index_(marks.intervals_.size()) {
      marks.add_interval(marks.mark(marks.lane_.stream), 0, seconds);
    }
    ~Timer() { marks_.intervals_[index_].end = marks_.mark_quietly(); }
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;

   private:
    StreamMarks& marks_;
    std::size_t index_;
  };

  /// Waits for all queued work and adds all times. Ends a job.
  void finish() {
    synchronize();
    for (const Interval& i : intervals_) {
      *i.seconds += lane_.events[i.end].seconds_since(lane_.events[i.begin]);
    }
    intervals_.clear();
    event_count_ = 0;
    stream_end_ = uploads_end_ = awaited_ = std::nullopt;
  }

 private:
  struct Interval {
    std::size_t begin, end;  // events
    double* seconds;
  };

  /// For destructors: an error shows up again at the next call.
  std::size_t mark_quietly() noexcept {
    try {
      return mark(lane_.stream);
    } catch (...) {
      return 0;
    }
  }

  CudaLane& lane_;
  std::vector<Interval> intervals_;
  std::size_t event_count_ = 0;
  std::optional<std::size_t> stream_end_, uploads_end_;  // marks with no work behind them
  std::optional<std::size_t> awaited_;                   // the last mark of the uploads
};

}  // namespace meshsmooth::detail
