#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <random>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "meshsmooth/trace_settings.hpp"
#include "traces/span.hpp"

namespace meshsmooth::server {

class Job;

/// Sends the spans of jobs to a collector, from a thread of its own. A collector that does not
/// answer costs no job anything: what it cannot take is kept up to a limit, then counted and
/// dropped. Thread-safe.
class SpanExporter {
 public:
  /// Without an endpoint nothing is sent.
  explicit SpanExporter(TraceSettings settings);
  ~SpanExporter();
  SpanExporter(const SpanExporter&) = delete;
  SpanExporter& operator=(const SpanExporter&) = delete;

  /// Waits for nobody; without room the job's spans are dropped.
  void add(const Job& ended) noexcept;
  /// Sends what is left, and waits for that half a second at most.
  void close();

  struct Counts {
    std::int64_t sent = 0;     // spans that a collector took
    std::int64_t dropped = 0;  // spans that it refused, or that there was no room for
  };
  [[nodiscard]] Counts counts() const;

 private:
  /// What became of a request.
  enum class Answer { taken, refused, none };

  [[nodiscard]] std::string make_id();
  void run(const std::stop_token& stop);
  [[nodiscard]] std::vector<JobSpans> take_batch();  // with the lock
  [[nodiscard]] Answer send(const std::vector<JobSpans>& batch,
                            std::chrono::milliseconds timeout) const;
  void finish_batch(std::vector<JobSpans> batch, Answer answer);

  const TraceSettings settings_;
  std::string host_;  // "http://collector:4318"
  std::string path_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::mt19937_64 random_;
  std::deque<JobSpans> waiting_;
  std::size_t waiting_spans_ = 0;
  Counts counts_;
  bool told_ = false;  // in the log that nothing gets through
  bool closed_ = false;
  std::jthread thread_;
};

}  // namespace meshsmooth::server
