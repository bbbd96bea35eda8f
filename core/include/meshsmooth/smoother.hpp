#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <concepts>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/summary.hpp"

namespace meshsmooth {

/// How far a job is.
struct Progress {
  Stage stage = Stage::find_neighbours;
  int iteration = 0;
  double max_displacement = 0;  // in the mesh's unit
  double rms_displacement = 0;
};

/// How a running job is observed and stopped. All members may be empty.
struct JobControl {
  /// Ends the job by `Cancelled`; checked at least every 50 ms of work, on a device between
  /// kernels (one kernel may take longer for a mesh with 10^8 elements).
  std::stop_token stop;
  /// Once true, the job ends with the positions reached so far.
  const std::atomic<bool>* finish_early = nullptr;
  /// Ends the job by `DeadlineExceeded` once passed.
  std::optional<std::chrono::steady_clock::time_point> deadline;
  /// Called on the job's thread, at most once per sweep; must not block.
  std::function<void(const Progress&)> on_progress;
  /// Called on the job's thread with the host memory that the job holds beyond
  /// `Smoother::estimate`, in bytes: of meshes that are not canonical (canonical_topology.hpp), for
  /// a second connectivity. What it throws ends the job.
  std::function<void(std::int64_t)> on_extra_memory;
};

/// The arrays of a job: the positions that it reads, where the result is written, and what else it
/// is given.
struct JobPositions {
  /// In place.
  template <std::convertible_to<PositionsSpan> Array>
  JobPositions(Array&& both) : result(std::forward<Array>(both)), given(as_view(result)) {}
  /// Both of one size, and of one type but for `Move`; they do not overlap, or are the same array.
  JobPositions(PositionsView from, PositionsSpan to) : result(to), given(from) {}

  /// With a derivative of `Move` no positions, but the tangents of all nodes, or the cotangents of
  /// the prescribed ones and 0 at the others.
  PositionsSpan result;
  PositionsView given;
  /// Whether `result` stays as it is when the job fails; else anything may be there then, and some
  /// jobs are faster.
  bool kept_on_error = true;
  JobInput input = {};
};

/// The sizes of a mesh: enough to estimate the memory of its job.
struct MeshSize {
  std::int64_t node_count = 0;
  std::array<std::int64_t, kElementTypeCount> element_counts{};
  bool float64 = true;
  bool regions = false;             // its elements have regions
  bool reference = false;           // a reference is kept with it, for motions
  bool node_pairs = false;          // jobs have `JobInput::node_pairs`
  std::int64_t surface_points = 0;  // of `JobInput::surface`
  std::int64_t surface_triangles = 0;
};

/// Bytes by memory space.
struct MemoryEstimate {
  std::int64_t host_bytes = 0;
  std::int64_t device_bytes = 0;
};

/// Memory of the device that a smoother works on; all 0 for the host.
struct DeviceSpace {
  std::int64_t total_bytes = 0;
  std::int64_t free_bytes = 0;  // now, for any process
  std::int64_t kept_bytes = 0;  // at most, that a smoother keeps between its jobs
};

/// The result of `Smoother::prepare`, for many jobs on one topology. Immutable; all smoothers of
/// the backend that made it may use it concurrently. This one is of backends that prepare every
/// job from scratch.
class PreparedTopology {
 public:
  virtual ~PreparedTopology() = default;

  /// The topology that it was made from.
  TopologyView topology;
  /// The reference that it was made with, or empty.
  PositionsView reference = {};

  /// @returns the bytes that it owns
  [[nodiscard]] virtual MemoryEstimate bytes() const { return {}; }
  /// @returns the number of nodes on the boundary; -1: not known yet
  [[nodiscard]] virtual std::int64_t boundary_node_count() const { return -1; }
};

/// One in-order slot on one backend: smooths one mesh after another. Not thread-safe; expensive
/// to construct, cheap to reuse.
class Smoother {
 public:
  virtual ~Smoother() = default;

  /// @returns the backend's name: "cpu", "cuda:0" …
  [[nodiscard]] virtual std::string_view backend() const = 0;

  /// @returns the device's memory now. Throws DeviceError.
  [[nodiscard]] virtual DeviceSpace device_space() const { return {}; }

  /// @returns an upper bound of the bytes that `smooth` allocates for a conforming mesh of this
  /// size, without the caller's arrays and `JobControl::on_extra_memory`. For sliding it assumes
  /// that the nodes between regions are at most a quarter as many as a cube's boundary has.
  [[nodiscard]] virtual MemoryEstimate estimate(const MeshSize& size,
                                                const SmoothOptions& options) const = 0;

  /// @returns whether jobs on a mesh of these element types read the positions that they are given
  /// once, into memory of a device: another process may then write them at the same time, which
  /// spoils the result and nothing else
  [[nodiscard]] virtual bool reads_positions_once(const MeshSize&) const { return false; }

  /// Smooths a mesh. O(elements + sweeps * edges).
  ///
  /// The same input gives the same bits on every call and with every number of threads,
  /// `Form::asynchronous` excepted. Fixed and isolated nodes keep their bits.
  ///
  /// @param positions  [topology.node_count], in the mesh's unit; the result is written once, at
  ///                   the end
  /// @throws InvalidMesh, InvalidOption, NotSupported, OutOfMemory, DeviceError, Cancelled,
  ///         DeadlineExceeded; positions are then unchanged (undefined only if a device is lost
  ///         while it writes them: a fatal DeviceError)
  virtual SmoothSummary smooth(const TopologyView& topology, const JobPositions& positions,
                               const SmoothOptions& options, const JobControl& control) = 0;

  /// Finds once what many jobs on one topology need: rings, balls, boundary. Independent of
  /// positions, so that all jobs on it have the same bits; they may differ in the last digits of
  /// sums from those of a bare topology, whose nodes are ordered by their positions.
  /// About twice the time of those steps of a job, on CUDA 50 to 100 times (1M nodes 82 ms, H200).
  ///
  /// With a reference, jobs of `Move` that are given this very array as their positions share
  /// what they need of it: the matrix of Laplace's equation and its multigrid hierarchy, for the
  /// newest set of fixed nodes. The first of them builds it, in the time of about 40 of its
  /// iterations.
  ///
  /// @param topology   the viewed arrays must outlive the result
  /// @param reference  [topology.node_count] or empty; must outlive the result, unchanged
  /// @throws what `smooth` throws for a topology
  [[nodiscard]] virtual std::shared_ptr<const PreparedTopology> prepare(
      const TopologyView& topology, const JobControl& control = {},
      const PositionsView& reference = {});
  /// @returns an upper bound of `PreparedTopology::bytes` for a mesh of this size
  [[nodiscard]] virtual MemoryEstimate estimate_prepared(const MeshSize& size) const;

  /// Smooths `prepared.topology`. O(nodes + sweeps * edges), and O(elements) to evaluate.
  virtual SmoothSummary smooth(const PreparedTopology& prepared, const JobPositions& positions,
                               const SmoothOptions& options, const JobControl& control);

  /// Smooths a mesh with its own positions.
  SmoothSummary smooth(Mesh& mesh, const SmoothOptions& options, const JobControl& control = {},
                       const JobInput& input = {}) {
    const MeshTopology topology(mesh);
    JobPositions positions(mesh.positions_span());
    positions.input = input;
    return smooth(topology.view(), positions, options, control);
  }
};

/// While it exists, at most this many threads of the process work on jobs of the CPU backend,
/// besides those that called `smooth`; of several objects the least applies. For control groups
/// whose quota is below the processor count: more threads would all be throttled together.
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

/// A backend of this build.
struct BackendInfo {
  std::string name;  // "cpu", "cuda:0"
  bool available;    // usable on this machine
  std::string device_name;
  std::int64_t device_bytes = 0;  // the device's memory; 0: it uses host memory
  std::string problem;            // why it is unavailable
};
/// @returns the backends of this build in order of preference: of CUDA one per device, or "cuda"
/// alone if there is no driver or device
[[nodiscard]] std::vector<BackendInfo> list_backends();

/// Creates a smoother.
///
/// @param backend       a name as backend_name.hpp has it; "auto": the first available
/// @param thread_count  of the CPU backend; 0: all cores
/// @throws NotSupported (BACKEND_NOT_AVAILABLE)
[[nodiscard]] std::unique_ptr<Smoother> make_smoother(std::string_view backend = "auto",
                                                      int thread_count = 0);

}  // namespace meshsmooth
