#include "rpc/result_stream.hpp"

#include <algorithm>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

using namespace std::chrono_literals;

// More frequent progress would only cost the lane time.
constexpr std::chrono::nanoseconds kMinProgressInterval = 10ms;
constexpr std::chrono::nanoseconds kMaxProgressInterval = 1h;
// Nothing notifies a job of its position in the queue, so it is polled.
constexpr auto kQueuePositionInterval = 100ms;

}  // namespace

std::exception_ptr ResultStream::notice(const JobSnapshot& job) {
  if (!result_) result_ = job.result;
  if (options_.upload_by_another_call && job.error && !job.times.queued && !job.stop_cause) {
    return std::make_exception_ptr(
        Error("UPLOAD_LOST",
              "the call that uploaded the mesh ended before the mesh was complete; "
              "send the mesh again"));
  }
  if (job.error) return job.error;
  const bool stops_here =
      job.state == JobState::sending || (options_.ends_uploads && job.state == JobState::receiving);
  if (job.stop_cause && stops_here) return job.stop_cause;
  if (has_ended(job.state) && !result_) {
    return std::make_exception_ptr(
        Error("RESULT_NOT_KEPT", "the job has ended and its result is no longer kept"));
  }
  return nullptr;
}

bool ResultStream::needs_queue_position(const JobSnapshot& job) const {
  return options_.progress_interval && part_ == Part::progress && job.state == JobState::queued;
}

ResultStream::Step ResultStream::next(const JobSnapshot& job, int queue_position,
                                      Clock::time_point now) {
  switch (part_) {
    case Part::progress:
      // Once the job is queued the header's topology has its name.
      if (options_.in_place && !header_sent_ && job.times.queued) return header();
      if (!result_) return next_progress(job, queue_position, now);
      part_ = Part::chunks;
      if (!header_sent_) return header();
      [[fallthrough]];
    case Part::chunks:
      if (!options_.in_place && sent_bytes_ < options_.result_bytes) return next_chunk();
      if (job.state == JobState::sending) return {.action = Action::complete_job};
      part_ = Part::done;
      return {.action = Action::send_summary};
    case Part::done:
      return {};
  }
  __builtin_unreachable();
}

ResultStream::Step ResultStream::next_progress(const JobSnapshot& job, int queue_position,
                                               Clock::time_point now) {
  if (!options_.progress_interval) return {};
  const bool changed = job.state != seen_state_ || job.progress_count != seen_progress_count_ ||
                       queue_position != seen_position_;
  if (!changed) {
    if (job.state == JobState::queued) return {.wake = now + kQueuePositionInterval};
    return {};
  }
  if (now < next_progress_) return {.wake = next_progress_};
  seen_state_ = job.state;
  seen_progress_count_ = job.progress_count;
  seen_position_ = queue_position;
  next_progress_ =
      now + std::clamp(*options_.progress_interval, kMinProgressInterval, kMaxProgressInterval);
  return {.action = Action::send_progress};
}

ResultStream::Step ResultStream::next_chunk() {
  const JobResult::Part part = result_->part_at(sent_bytes_);
  const auto data =
      part.bytes.first(std::min(part.bytes.size(), static_cast<std::size_t>(options_.chunk_bytes)));
  const Step step{.action = Action::send_chunk,
                  .array_id = part.array_id,
                  .offset = part.offset_bytes,
                  .data = data};
  sent_bytes_ += static_cast<std::int64_t>(data.size());
  return step;
}

}  // namespace meshsmooth::server
