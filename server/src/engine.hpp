#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "admission.hpp"
#include "job.hpp"
#include "job_queue.hpp"
#include "job_store.hpp"
#include "lane_pool.hpp"
#include "memory_budget.hpp"
#include "meshsmooth/server.hpp"
#include "meshsmooth/server_config.hpp"
#include "meshsmooth/staging_memory.hpp"
#include "metrics.hpp"
#include "result_store.hpp"
#include "topology_cache.hpp"
#include "traces/span_exporter.hpp"
#include "transport/transport.hpp"

namespace meshsmooth::server {

struct Resources;

/// Everything of the server except gRPC: admits jobs, runs them on lanes, and ends them. Nobody
/// else ends a job. Thread-safe.
class Engine {
 public:
  /// Starts the lanes. `on_lanes_lost` is called once, by any thread, when none is left in service.
  /// Throws what `acquire_resources` throws.
  Engine(
      ServerConfig config, const SmootherFactory& factory,
      std::function<void()> on_lanes_lost = [] {});
  /// Stops every job and waits for the lanes.
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// The configuration with every default that depends on the machine filled in.
  [[nodiscard]] const ServerConfig& config() const { return config_; }
  [[nodiscard]] wire::MeshLimits mesh_limits() const;

  // --- the life of a job -------------------------------------------------------------

  /// See Admission.
  [[nodiscard]] MemoryEstimate estimate(const JobRequest& request) const {
    return admission_.estimate(request);
  }
  [[nodiscard]] bool reads_positions_once(const MeshSize& size) const {
    return admission_.reads_positions_once(size);
  }
  /// See Admission; also throws Error (DRAINING).
  [[nodiscard]] Subscription admit(const JobRequest& request, const Job::Observer& observer);
  /// See Admission.
  [[nodiscard]] Subscription subscribe(const std::shared_ptr<Job>& job, const std::string& share,
                                       const Job::Observer& observer) {
    return admission_.subscribe(job, share, observer);
  }

  /// Whether somebody was refused for lack of memory just now, so that uploads which pause have to
  /// give theirs up.
  [[nodiscard]] bool memory_short(Clock::time_point now) const;

  /// Ends a call's part in a job. A job whose mesh this call has not completely uploaded ends by
  /// `cause`, and so does one that is not kept and that no other call waits for.
  void leave(Subscription& subscription, const std::exception_ptr& cause);

  /// Queues a job whose mesh is complete.
  void submit(const std::shared_ptr<Job>& job);

  /// Ends a job as succeeded: a call has sent all its positions.
  void complete(Job& job);

  /// Ends a queued job at once, and any other as soon as its current owner notices.
  void cancel(Job& job, std::exception_ptr cause);
  /// Ends the job only if it still waits in the queue.
  void end_waiting(Job& job, std::exception_ptr cause);

  /// Forgets a job that has ended. Throws Error (JOB_NOT_FINISHED).
  void forget(Job& job);

  /// Every call that has a job reports its begin, and its end after the last byte is sent.
  void call_began() { ++calls_; }
  void call_ended();
  [[nodiscard]] int call_count() const { return calls_; }

  // --- the parts ---------------------------------------------------------------------

  [[nodiscard]] const JobStore& store() const { return store_; }
  [[nodiscard]] TopologyCache& topologies() { return topologies_; }
  [[nodiscard]] const TopologyCache& topologies() const { return topologies_; }
  [[nodiscard]] const JobQueue& queue() const { return queue_; }
  [[nodiscard]] const MemoryBudget& memory_budget() const { return budget_; }
  /// The most host memory that the process uses: what it had when all lanes existed, what may be
  /// reserved for jobs and streams, what is kept for the next jobs, and what the heap retains and
  /// connections use.
  [[nodiscard]] std::int64_t memory_ceiling_bytes() const;
  /// What of it gRPC may have for connections, calls and messages.
  [[nodiscard]] std::int64_t transport_bytes() const;
  /// What of it connections may use now that nothing has been answered to.
  [[nodiscard]] std::int64_t unanswered_budget_bytes() const;
  [[nodiscard]] Metrics& metrics() { return metrics_; }
  [[nodiscard]] const Metrics& metrics() const { return metrics_; }
  [[nodiscard]] const SpanExporter& traces() const { return traces_; }
  [[nodiscard]] std::vector<std::shared_ptr<const Lane>> lanes() const { return lanes_->lanes(); }
  /// The backend of each device, "cuda:0" …; `Lane::device` is an index into it.
  [[nodiscard]] const std::vector<std::string>& devices() const { return devices_; }
  /// Why backends that "auto" prefers are not used; empty when the best one is.
  [[nodiscard]] const std::string& passed_over() const { return passed_over_; }

  [[nodiscard]] Transport& transport() { return transport_; }
  [[nodiscard]] const Transport& transport() const { return transport_; }

  // --- drain -------------------------------------------------------------------------

  [[nodiscard]] bool draining() const { return draining_; }
  void refuse_new();
  /// Ends all jobs that do not run yet, as DRAINING: their callers send them to another server.
  void reject_waiting();
  void stop_all();
  /// Waits for the lanes in service; they take no more jobs, and nothing is leased any more.
  void close();
  /// Waits until `until`, or until `give_up` is set; `wait_idle` at most until all jobs and their
  /// calls have ended.
  void wait(Clock::time_point until, const std::atomic<bool>& give_up);
  void wait_idle(Clock::time_point until, const std::atomic<bool>& give_up);
  /// Makes both check `give_up`.
  void wake();

 private:
  Engine(Resources resources, std::function<void()> on_lanes_lost);
  void close_device(int device);
  [[nodiscard]] Subscription admit_or_make_room(const JobRequest& request,
                                                const Job::Observer& observer);
  void make_room(Clock::time_point now);
  void finish(Job& job, SmoothSummary summary);
  void retire(const Job& job);
  void run_maintenance(const std::stop_token& stop);
  void end_late_jobs(Clock::time_point now);

  const ServerConfig config_;
  const std::string passed_over_;
  const std::unique_ptr<ThreadLimit> threads_;
  const std::unique_ptr<StagingMemory> staging_;  // the arrays of meshes
  const std::int64_t resident_at_start_bytes_;
  MemoryBudget budget_;
  Transport transport_;
  TopologyCache topologies_;
  JobQueue queue_;
  JobStore store_;
  Admission admission_;
  Metrics metrics_;
  SpanExporter traces_;
  ResultStore results_;
  std::atomic<Clock::time_point> memory_short_at_ = Clock::time_point::min();
  std::atomic<bool> draining_ = false;
  std::atomic<int> calls_ = 0;
  std::mutex idle_mutex_;
  std::condition_variable idle_;
  std::vector<std::string> devices_;
  const std::function<void()> on_lanes_lost_;
  std::unique_ptr<LanePool> lanes_;
  std::jthread maintenance_;  // maintenance thread: expiry, queue timeouts, watchdog
};

/// The error of every call that a draining server refuses.
[[nodiscard]] std::exception_ptr draining_error();

}  // namespace meshsmooth::server
