#pragma once

#include "meshsmooth/smoother.hpp"
#include "smooth/base/rows.hpp"
#include "smooth/base/space_curve.hpp"

namespace meshsmooth::detail {

/// The caller's elements in internal numbers: grouped by type, inside a type in
/// the order of their lowest node, so that walks over elements are local.
template <Executor E>
struct JobElements {
  Elements view;
  int dimension = 3;
  typename E::template Buffer<NodeId> connectivity;
  typename E::template Buffer<ElementId> caller_ids;  // internal element -> caller's
};

/// Reports the beginning of a stage and measures the time until the end of the object.
template <Executor E>
class StageTimer {
 public:
  StageTimer(E& executor, double& seconds, const JobControl& control, Stage stage)
      : timer_(executor, seconds) {
    if (control.on_progress) control.on_progress({stage, 0, 0, 0});
  }

 private:
  typename E::Timer timer_;
};

/// What the evaluation of a result finds.
struct QualityReport {
  QualityStats quality;
  LockedStats locked;
};

/// A mesh as the sweeps need it, in internal numbers.
template <Executor E, class Real>
struct JobMesh {
  std::size_t node_count = 0;
  typename E::template HostArray<Vec3<Real>> given;  // the caller's positions
  typename E::template Buffer<NodeId> caller_ids;    // internal node -> caller's
  JobElements<E> elements;
  RowBuffer<E, ElementId> balls;
  RowBuffer<E, NodeId> rings;
  typename E::template Buffer<Vec3<Real>> positions;
  typename E::template Buffer<std::uint8_t> fixed;  // 1: the node stays
  Box box{};
  NodeCounts nodes;
  std::size_t free_count = 0;

  [[nodiscard]] bool volume() const { return elements.dimension == 3; }
};

}  // namespace meshsmooth::detail
