#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <vector>

namespace prometheus {
struct MetricFamily;
}

namespace meshsmooth::server {

class Job;

/// Counts events for Prometheus. Thread-safe.
class Metrics {
 public:
  Metrics();
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  /// A job has ended.
  void job_ended(const Job& job);
  /// A call failed with `error` before it had a job.
  void refused(const std::exception_ptr& error);
  /// A call of any kind without valid credentials.
  void denied(const std::string& reason);
  /// Mesh data and result data, in bytes.
  void received(std::int64_t bytes);
  void sent(std::int64_t bytes);

  /// Everything counted so far.
  [[nodiscard]] std::vector<prometheus::MetricFamily> collect() const;

 private:
  struct Impl;
  const std::unique_ptr<Impl> impl_;
};

}  // namespace meshsmooth::server
