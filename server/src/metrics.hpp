#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <string>

namespace meshsmooth::server {

class Engine;
class Job;

/// Counts what happened to jobs, for Prometheus; docs/operations.md lists the
/// names. Thread-safe.
class Metrics {
 public:
  Metrics();
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  /// A job is over.
  void job_ended(const Job& job);
  /// A call ended by `error` before it became a job.
  void refused(const std::exception_ptr& error);
  /// A call of any kind whose caller was not let in.
  void denied(const std::string& reason);
  /// Bytes of meshes, as they pass.
  void received(std::int64_t bytes);
  void sent(std::int64_t bytes);

 private:
  friend std::string expose_metrics(const Engine* engine);
  struct Impl;
  const std::unique_ptr<Impl> impl_;
};

/// All metrics in Prometheus' text format: what was counted, and what the engine
/// is at just now; nothing but the process without one. O(living jobs).
[[nodiscard]] std::string expose_metrics(const Engine* engine);

}  // namespace meshsmooth::server
