#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "gpu/bench_mesh.hpp"
#include "gpu/cuda.hpp"
#include "gpu/report.hpp"
#include "meshsmooth/smoother.hpp"

namespace meshsmooth::bench {

/// Connectivity in page-locked memory, as the server's upload leaves it.
class PinnedTopology {
 public:
  explicit PinnedTopology(const BenchMesh& mesh)
      : tetrahedra_(mesh.tetrahedra.size()), node_count_(mesh.node_count()) {
    std::copy(mesh.tetrahedra.begin(), mesh.tetrahedra.end(), tetrahedra_.data());
    block_ = {ElementType::tetrahedron, {tetrahedra_.data(), tetrahedra_.size()}};
  }
  PinnedTopology(const PinnedTopology&) = delete;
  PinnedTopology& operator=(const PinnedTopology&) = delete;
  [[nodiscard]] TopologyView view() const { return {node_count_, {&block_, 1}, {}}; }

 private:
  PinnedArray<NodeId> tetrahedra_;
  std::size_t node_count_;
  ElementBlockView block_{};
};

/// Positions in page-locked memory that are smoothed again and again.
template <class Real>
class PinnedPositions {
 public:
  explicit PinnedPositions(const BenchMesh& mesh) : places_(mesh.node_count()) {
    original_.reserve(mesh.node_count());
    for (const Vec3d& place : mesh.positions) original_.push_back(vec3_cast<Real>(place));
    restore();
  }
  void restore() { std::copy(original_.begin(), original_.end(), places_.data()); }
  [[nodiscard]] std::span<Vec3<Real>> span() { return {places_.data(), places_.size()}; }
  [[nodiscard]] std::vector<Vec3f> as_float() const {
    std::vector<Vec3f> result(places_.size());
    std::transform(places_.data(), places_.data() + places_.size(), result.begin(),
                   vec3_cast<float, Real>);
    return result;
  }

 private:
  std::vector<Vec3<Real>> original_;
  PinnedArray<Vec3<Real>> places_;
};

/// Medians over the runs, in milliseconds; the rest is of the last run.
struct ProductFigures {
  double wall_ms = 0;
  double upload_ms = 0;
  double neighbours_ms = 0;
  double boundary_ms = 0;
  double iterate_ms = 0;
  double evaluate_ms = 0;
  double download_ms = 0;
  SmoothSummary summary;
};

/// What the paper's algorithm does: uniform Laplacian, form A, no guard, until no
/// node moves farther than `tolerance` of the mesh's unit.
[[nodiscard]] SmoothOptions plain_options(double tolerance, int max_iterations = 1000);

/// Calls `smooth` `repeats` times after two warm-ups, always on the same input; on what was
/// prepared of the topology, if it is given.
template <class Real>
[[nodiscard]] ProductFigures measure_product(Smoother& smoother, const PinnedTopology& topology,
                                             PinnedPositions<Real>& positions,
                                             const SmoothOptions& options, int repeats,
                                             const PreparedTopology* prepared = nullptr);

/// What a sweep takes: the iterations of 120 sweeps less those of 20, over 100.
template <class Real>
[[nodiscard]] double sweep_microseconds(Smoother& smoother, const PinnedTopology& topology,
                                        PinnedPositions<Real>& positions, int repeats);

[[nodiscard]] Json to_json(const ProductFigures& figures);

}  // namespace meshsmooth::bench
