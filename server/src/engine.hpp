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

#include "job.hpp"
#include "job_queue.hpp"
#include "job_store.hpp"
#include "lane.hpp"
#include "ledger.hpp"
#include "meshsmooth/server.hpp"
#include "meshsmooth/server_config.hpp"
#include "meshsmooth/staging_memory.hpp"
#include "metrics.hpp"
#include "result_store.hpp"
#include "topology_cache.hpp"
#include "upload_share.hpp"

namespace meshsmooth::server {

struct Equipment;

/// A call's part in a job: while it lasts, the call hears of changes and has the
/// memory of its stream. Given back by `Engine::leave`.
struct Attendance {
  std::shared_ptr<Job> job;
  int watcher = 0;
  bool joined = false;  // the job is another call's: this one brings no mesh
  Reservation stream;
};

/// Everything of the server that is not gRPC: admits jobs, runs them, ends
/// them. Thread-safe.
class Engine {
 public:
  /// Starts the lanes. `on_lane_broken` is called by a lane's own thread.
  /// Throws what `equip` throws.
  Engine(
      ServerConfig config, const SmootherFactory& factory,
      const std::function<void()>& on_lane_broken = [] {});
  /// Stops every job and waits for the lanes.
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// With every 0 that stands for a default filled in.
  [[nodiscard]] const ServerConfig& config() const { return config_; }
  [[nodiscard]] wire::MeshLimits mesh_limits() const;

  /// All that a job needs: its arrays, the smoother's own memory, buffers of
  /// the stream. Throws OutOfMemory (MESH_TOO_LARGE) when it could never fit.
  [[nodiscard]] MemoryEstimate estimate(const JobRequest& request) const;

  /// A new job, or the caller's own of the same request id. Reserves first, then
  /// allocates. Throws OutOfMemory (MESH_TOO_LARGE, HOST_MEMORY_BUSY,
  /// DEVICE_MEMORY_BUSY, QUEUE_FULL, QUOTA_EXCEEDED) or Error (DRAINING; REQUEST_ID_REUSED: that
  /// job's spec is another).
  [[nodiscard]] Attendance admit(JobRequest request, const Job::Observer& observer);

  /// A part in a job that is there already. Throws OutOfMemory
  /// (HOST_MEMORY_BUSY), Error (RESULT_NOT_KEPT), or why the job failed.
  [[nodiscard]] Attendance attend(const std::shared_ptr<Job>& job, const Job::Observer& observer);

  /// Ends a call's part, by `cause` what nobody else waits for: a job whose mesh it
  /// has not brought to the end, and one that is not kept.
  void leave(Attendance& attendance, const std::exception_ptr& cause);

  /// Queues a job whose mesh is complete.
  void submit(const std::shared_ptr<Job>& job);

  /// A call has sent all positions: the job has succeeded.
  void complete(Job& job);

  /// Ends the job as soon as the actor whose turn it is looks; a queued one at
  /// once.
  void cancel(Job& job, std::exception_ptr cause);
  /// Ends the job only if it still waits in the queue.
  void end_waiting(Job& job, std::exception_ptr cause);

  /// Forgets a job that has ended. Throws Error (JOB_NOT_FINISHED).
  void forget(Job& job);

  /// Every call that has a job says when it is over, with the last byte sent.
  void call_began() { ++calls_; }
  void call_ended();
  [[nodiscard]] int call_count() const { return calls_; }

  [[nodiscard]] const JobStore& store() const { return store_; }
  [[nodiscard]] TopologyCache& topologies() { return topologies_; }
  [[nodiscard]] const TopologyCache& topologies() const { return topologies_; }
  [[nodiscard]] const JobQueue& queue() const { return queue_; }
  [[nodiscard]] const Ledger& ledger() const { return ledger_; }
  /// What the process takes at most of the host's memory: what it had when all lanes were there,
  /// what may be promised to jobs and streams, what waits for the next jobs, and what the heap
  /// keeps and connections take.
  [[nodiscard]] std::int64_t memory_ceiling_bytes() const;
  [[nodiscard]] Metrics& metrics() { return metrics_; }
  [[nodiscard]] const Metrics& metrics() const { return metrics_; }
  [[nodiscard]] const std::vector<std::unique_ptr<Lane>>& lanes() const { return lanes_; }
  /// The backend of each device, "cuda:0" …; `Lane::device` is an index in it.
  [[nodiscard]] const std::vector<std::string>& devices() const { return devices_; }
  /// Why backends that "auto" prefers do not run; empty when the best one does.
  [[nodiscard]] const std::string& passed_over() const { return passed_over_; }

  // The steps of a drain.
  [[nodiscard]] bool draining() const { return draining_; }
  void refuse_new() { draining_ = true; }
  void hand_back_waiting();
  void stop_all();
  /// Waits for the lanes; they take no job any more.
  void close();
  /// Waits until the time has come, or `give_up`, or (idle) all jobs and their
  /// calls ended.
  void wait(Clock::time_point until, const std::atomic<bool>& give_up);
  void wait_idle(Clock::time_point until, const std::atomic<bool>& give_up);
  /// Makes both look at `give_up`.
  void wake();

 private:
  Engine(Equipment equipment, const std::function<void()>& on_lane_broken);
  /// Of the mesh's arrays, as they are allocated.
  [[nodiscard]] std::int64_t array_bytes(const wire::MeshLayout& layout) const;
  [[nodiscard]] std::int64_t array_bytes(std::int64_t bytes) const;
  [[nodiscard]] std::optional<Attendance> join(const JobRequest& request,
                                               const Job::Observer& observer);
  /// Evicts topologies before it refuses.
  [[nodiscard]] Reservation reserve(MemoryEstimate need,
                                    const std::vector<int>& preferred_devices = {});
  void retire(const Job& job);
  void keep_house(const std::stop_token& stop);

  const ServerConfig config_;
  const std::string passed_over_;
  const std::unique_ptr<ThreadLimit> threads_;
  const std::unique_ptr<StagingMemory> staging_;  // the arrays of meshes
  const std::int64_t resident_at_start_bytes_;
  const std::string instance_;  // makes job names differ between runs
  Ledger ledger_;
  TopologyCache topologies_;
  JobQueue queue_;
  UploadShares uploads_;
  JobStore store_;
  Metrics metrics_;
  ResultStore results_;
  std::atomic<bool> draining_ = false;
  std::atomic<std::int64_t> next_sequence_ = 1;
  std::atomic<int> calls_ = 0;
  std::mutex idle_mutex_;
  std::condition_variable idle_;
  std::vector<std::string> devices_;
  std::vector<std::unique_ptr<Lane>> lanes_;
  std::jthread housekeeper_;  // what time alone brings about
};

/// The error of every call that a leaving server refuses.
[[nodiscard]] std::exception_ptr draining_error();

/// That of a job which waited longer than its caller wants.
[[nodiscard]] std::exception_ptr queue_timeout_error();

}  // namespace meshsmooth::server
