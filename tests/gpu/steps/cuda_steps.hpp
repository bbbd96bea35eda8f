#pragma once

// Single steps of the CUDA backend, each as one call on host data. This header and the .cu files
// beside it are all that the tests know of the backend's insides; what a step needs from the steps
// before it comes from the oracle (`FlatMesh`). All calls use device 0.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gpu/steps/flat_mesh.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/summary.hpp"

namespace meshsmooth::test {

// --- the executor's verbs ---------------------------------------------------------

/// The sum of `values` and the least of them, by `reduce`.
struct DeviceReduction {
  std::uint64_t sum = 0;
  std::uint32_t least = 0;
};
[[nodiscard]] DeviceReduction reduce_on_device(const std::vector<std::uint32_t>& values);
/// In place; returns the sum.
std::int64_t scan_on_device(std::vector<std::int64_t>& values);

// --- topology ---------------------------------------------------------------------

struct DeviceOrder {
  std::vector<NodeId> caller_ids;   // of internal nodes
  std::vector<NodeId> internal_of;  // of the caller's
  std::vector<Vec3d> positions;     // in internal order
  Vec3d lower, upper;               // corners of the bounding box
  bool wrong_position = false;      // one is not finite
};
[[nodiscard]] DeviceOrder order_nodes_on_device(const Mesh& mesh);

/// What a topology that is prepared without positions is ordered by.
struct DeviceLandmarks {
  std::vector<NodeId> nodes;
  std::vector<std::vector<int>> steps;  // by landmark and node; -1: no way
  std::vector<Vec3d> places;            // of nodes
};
[[nodiscard]] DeviceLandmarks place_by_edges_on_device(
    const std::vector<std::vector<NodeId>>& rings);

/// What `prepare_job` finds, by the caller's ids.
struct DeviceTopology {
  std::vector<std::vector<std::int64_t>> balls;  // empty where they are not kept
  std::vector<std::vector<NodeId>> rings;
  std::vector<bool> fixed;
  NodeCounts nodes;
  std::size_t free_count = 0;
  Vec3d lower, upper;
};
[[nodiscard]] DeviceTopology prepare_on_device(const Mesh& mesh, const SmoothOptions& options);

/// Internal node ids, colour after colour.
[[nodiscard]] std::vector<std::vector<NodeId>> colour_on_device(const FlatMesh& mesh);

// --- sweeps -----------------------------------------------------------------------

/// The order in which coloured sweeps visit nodes, colour after colour.
struct DeviceVisit {
  NodeId node;
  std::int64_t ball_begin;
  std::int32_t ball_size;
};
[[nodiscard]] std::vector<std::vector<DeviceVisit>> ball_records_on_device(const FlatMesh& mesh);

/// Cuts of moves over many rounds of a cooperative grid.
struct DeviceCuts {
  std::vector<int> cuts;                  // by node
  std::vector<std::vector<bool>> broken;  // by round and block: what its barrier reported
  std::vector<bool> consistent;           // by node: each round saw the cuts before it
};
/// `demands`: by round, the nodes of which it demands a cut; fewer than `node_count`.
[[nodiscard]] DeviceCuts cut_on_device(std::size_t node_count,
                                       const std::vector<std::vector<NodeId>>& demands);

enum class SweepKernel {
  resident,     // Jacobi in shared memory; float32, uniform mean
  jacobi,       // Jacobi in device memory
  jacobi_sell,  // the same with rings in SELL; uniform mean
  coloured_8,   // Gauss-Seidel, so many threads to a node
  coloured_16,
  coloured_32,
  step,  // one sweep per call of the host, in the form of the options
};

struct DeviceSweeps {
  bool ran = false;              // false: the kernel declined the mesh
  std::vector<Vec3d> positions;  // in internal order
  Convergence convergence;
  StopReason stop_reason = StopReason::converged;
};
/// Sweeps of `options` by one kernel. The method is Laplacian, SmartLaplacian or, for
/// `SweepKernel::step`, any but Optimize; of weightings the coloured kernels have uniform and
/// ball_volume here, `step` has uniform.
[[nodiscard]] DeviceSweeps sweep_on_device(const FlatMesh& mesh, SweepKernel kernel, bool float32,
                                           const SmoothOptions& options);

// --- optimize ---------------------------------------------------------------------

struct PhaseRequest {
  int power = 2;
  double poor = 0;  // only balls whose worst inverse mean ratio is above
  bool guard = true;
  int sweeps = 1;
  std::optional<double> movement_limit = {};  // in the mesh's unit
};
struct PhaseResult {
  std::vector<Vec3d> positions;  // in internal order
  int sweeps = 0;
  double gain = 0;  // of the last sweep, as the others
  std::int64_t tangled = 0, moved = 0, held = 0;
  // Of the mesh afterwards.
  double energy = 0, weight = 0, worst_mean_ratio = 0;
  std::int64_t invalid = 0;
};
[[nodiscard]] PhaseResult optimize_on_device(const FlatMesh& mesh, bool float32,
                                             const PhaseRequest& request);

/// Of a mesh of tetrahedra: beside each entry of the balls the other nodes, in the order of the
/// corner's edges.
[[nodiscard]] std::vector<NodeId> opposite_nodes_on_device(const FlatMesh& mesh);

// --- quality ----------------------------------------------------------------------

struct DeviceEvaluation {
  QualityStats quality;
  LockedStats locked;
  ElementQualityArrays elements;  // every metric
  std::vector<Vec3d> written;     // the caller's positions afterwards
  std::int64_t moved = 0;
};
/// Evaluates `flat.positions` as the result of a job on `mesh`, and writes them back.
[[nodiscard]] DeviceEvaluation evaluate_on_device(const Mesh& mesh, const FlatMesh& flat,
                                                  QualityDetail detail = QualityDetail::full);

}  // namespace meshsmooth::test
