#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/summary.hpp"

namespace meshsmooth {

enum class Stage { find_neighbours, find_boundary, iterate, evaluate };

struct Progress {
  Stage stage = Stage::find_neighbours;
  int iteration = 0;
  double max_displacement = 0;  // in the mesh's unit
  double rms_displacement = 0;
};

/// How a running job is watched and stopped. All members may be left empty.
struct JobControl {
  /// Ends the job by `Cancelled`; looked at at least every 50 ms of work, on a device
  /// between its kernels: of a mesh with 10^8 elements one may take longer.
  std::stop_token stop;
  /// Once true, the job ends with the positions reached so far.
  const std::atomic<bool>* finish_early = nullptr;
  /// Ends the job by `DeadlineExceeded` once passed.
  std::optional<std::chrono::steady_clock::time_point> deadline;
  /// Called by the job's own thread, at most once a sweep; must not block.
  std::function<void(const Progress&)> on_progress;
};

/// What is known of a mesh before its data: enough to foresee its memory.
struct MeshSize {
  std::int64_t node_count = 0;
  std::array<std::int64_t, kElementTypeCount> element_counts{};
  bool float64 = true;
  bool regions = false;  // its elements have regions
};

struct MemoryEstimate {
  std::int64_t host_bytes = 0;
  std::int64_t device_bytes = 0;
};

/// Memory of the device that a smoother works on; all 0 where that is the host.
struct DeviceSpace {
  std::int64_t total_bytes = 0;
  std::int64_t free_bytes = 0;  // now, whoever takes it
  std::int64_t kept_bytes = 0;  // what a smoother holds between its jobs, at most
};

/// What `Smoother::prepare` found out about a topology, for many jobs. It does not change, and
/// serves every smoother of the backend that made it, several at the same time.
class PreparedTopology {
 public:
  virtual ~PreparedTopology() = default;

  /// Of which it was made.
  TopologyView topology;

  /// What it holds.
  [[nodiscard]] virtual MemoryEstimate bytes() const = 0;
  /// -1: not known yet.
  [[nodiscard]] virtual std::int64_t boundary_node_count() const { return -1; }
};

/// One in-order slot on one backend: takes a mesh and options, moves its nodes,
/// says what happened. Not thread-safe; costly to build, cheap to call again.
class Smoother {
 public:
  virtual ~Smoother() = default;

  /// "cpu", "cuda:0" …
  [[nodiscard]] virtual std::string_view backend() const = 0;

  /// Throws DeviceError.
  [[nodiscard]] virtual DeviceSpace device_space() const { return {}; }

  /// Upper bound of the bytes that `smooth` allocates for an ordinary
  /// (conforming) mesh of this size, the caller's arrays not counted. For sliding, of one whose
  /// regions meet in no more than a quarter as many nodes as a cube's boundary has.
  [[nodiscard]] virtual MemoryEstimate estimate(const MeshSize& size,
                                                const SmoothOptions& options) const = 0;

  /// Smooths `positions` in place: they are written once, when all has gone
  /// well. Fixed and isolated nodes keep their bits. The same input gives the
  /// same bits on every call and with every number of threads, `Form::asynchronous`
  /// excepted.
  ///
  /// Throws InvalidMesh, InvalidOption, NotSupported, OutOfMemory, DeviceError,
  /// Cancelled, DeadlineExceeded; positions are then as they were. (Only a device
  /// that is lost while it writes them leaves them undefined: a fatal DeviceError.)
  /// O(elements + sweeps * edges).
  virtual SmoothSummary smooth(const TopologyView& topology, PositionsSpan positions,
                               const SmoothOptions& options, const JobControl& control) = 0;

  /// Does once what many jobs on one topology need: rings, balls, boundary. All that
  /// `topology` views must outlive the result. It does not depend on positions, so a job
  /// on it has the same bits whenever it was made; they may differ in the last digits of
  /// sums from those of `smooth` without it, where nodes are numbered by their positions.
  ///
  /// Throws what `smooth` throws of a topology. About twice the time of those steps of a job.
  [[nodiscard]] virtual std::shared_ptr<const PreparedTopology> prepare(
      const TopologyView& topology, const JobControl& control = {});
  /// Upper bound of `PreparedTopology::bytes` for a mesh of this size.
  [[nodiscard]] virtual MemoryEstimate estimate_prepared(const MeshSize& size) const;

  /// As the other, with `prepared.topology`. O(nodes + sweeps * edges), and the judging.
  virtual SmoothSummary smooth(const PreparedTopology& prepared, PositionsSpan positions,
                               const SmoothOptions& options, const JobControl& control);

  SmoothSummary smooth(Mesh& mesh, const SmoothOptions& options, const JobControl& control = {}) {
    const MeshTopology topology(mesh);
    return smooth(topology.view(), mesh.positions_span(), options, control);
  }
};

/// While it lives, no more than so many threads of this process work on jobs of the CPU backend,
/// beside those that called `smooth`. Of several the least holds. Where a control group's quota
/// allows less than the processor has, more would be held up all together.
class ThreadLimit {
 public:
  explicit ThreadLimit(int thread_count);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The backends compiled in, in order of preference; of CUDA one per device, or
/// "cuda" alone where no device can be asked.
struct BackendInfo {
  std::string name;  // "cpu", "cuda:0"
  bool available;    // usable on this machine
  std::string device_name;
  std::int64_t device_bytes = 0;  // the device's memory; 0: it works in the host's
  std::string problem;            // why it is not available
};
[[nodiscard]] std::vector<BackendInfo> list_backends();

/// `backend` is "auto", "cpu", "cuda" or "cuda:N"; `thread_count` 0 means all
/// cores. Throws `NotSupported` (BACKEND_NOT_AVAILABLE).
[[nodiscard]] std::unique_ptr<Smoother> make_smoother(std::string_view backend = "auto",
                                                      int thread_count = 0);

}  // namespace meshsmooth
