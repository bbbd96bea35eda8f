#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace meshsmooth::cli {

/// How a job of a load ended.
enum class Outcome { ok, refused, failed };

/// One of them; times in seconds since the load began.
struct LoadSample {
  double end = 0;
  double latency = 0;  // since it was due
  Outcome outcome = Outcome::ok;
  std::string reason;  // unless ok
  std::int64_t bytes_up = 0, bytes_down = 0;
};

/// What came of the jobs that ended within some time.
struct LoadFigures {
  double seconds = 0;
  std::int64_t ok_count = 0, refused_count = 0, failed_count = 0;
  std::map<std::string, std::int64_t> refused, failed;  // by reason
  double jobs_per_second = 0;                           // that were ok; so are the rest
  double megabytes_up_per_second = 0, megabytes_down_per_second = 0;
  double p50 = 0, p90 = 0, p99 = 0, p999 = 0, max = 0;  // seconds
};

/// The least value that is not below a share (0 to 1] of them; 0 of none. O(n).
[[nodiscard]] double percentile(std::vector<double> values, double share);

/// Of the samples that ended in [from, to). O(n).
[[nodiscard]] LoadFigures figures_of(std::span<const LoadSample> samples, double from, double to);

/// Whether a load has settled: rate and median latency of each of the last three windows are
/// within 10 % of their mean, and each window has a job that was ok.
[[nodiscard]] bool is_steady(std::span<const LoadFigures> windows);

/// Collects samples of many threads.
class LoadRecord {
 public:
  void add(LoadSample sample) {
    const std::lock_guard lock(mutex_);
    samples_.push_back(std::move(sample));
  }
  [[nodiscard]] std::vector<LoadSample> samples() const {
    const std::lock_guard lock(mutex_);
    return samples_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<LoadSample> samples_;
};

/// A size and how often it is sent, against the others.
struct LoadSize {
  std::size_t node_count = 0;
  double weight = 1;
};

/// "5000" or "5000:3". Throws `InvalidOption` (OPTION_OUT_OF_RANGE).
[[nodiscard]] LoadSize parse_load_size(const std::string& text);

}  // namespace meshsmooth::cli
