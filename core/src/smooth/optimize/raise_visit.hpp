#pragma once

#include <limits>

#include "mesh/accumulator.hpp"
#include "mesh/measure.hpp"
#include "smooth/base/closest_point.hpp"
#include "smooth/base/convergence.hpp"
#include "smooth/base/displacement.hpp"
#include "smooth/base/surroundings.hpp"
#include "smooth/energy/newton_step.hpp"

namespace meshsmooth::detail {

/// The scaled Jacobian at a corner of an element as a function of the position of one node.
class JacobianCorner {
 public:
  /// @param own  the node, by its place in the element
  MESHSMOOTH_HD JacobianCorner(const ElementShape& shape, int k, int own, const Vec3d* positions,
                               Vec3d reference)
      : corner_(shape.corners[k]), own_(own), edge_count_(shape.dimension) {
    if (!has_node()) return;
    for (int i = 0; i < edge_count_; ++i) {
      edges_[i] = positions[corner_.neighbours[i]] - positions[corner_.node];
    }
    if (edge_count_ == 2) {  // then the third edge is the unit normal
      const Vec3d normal = cross(edges_[0], edges_[1]);
      const double area = norm(normal);
      const bool turned = dot(normal, reference) < 0;
      edges_[2] = area > 0 ? ((turned ? -1 : 1) / area) * normal : Vec3d{0, 0, 0};
    }
    double product = shape.ideal.determinant;
    for (int i = 0; i < edge_count_; ++i) product *= norm(edges_[i]);
    scale_ = product > 0 ? 1 / product : 0;
    value_ = scale_ * dot(edges_[0], cross(edges_[1], edges_[2]));
  }

  [[nodiscard]] MESHSMOOTH_HD bool has_node() const {
    bool has = corner_.node == own_;
    for (int i = 0; i < edge_count_; ++i) has = has || corner_.neighbours[i] == own_;
    return has;
  }
  [[nodiscard]] MESHSMOOTH_HD double value() const { return value_; }
  [[nodiscard]] MESHSMOOTH_HD Vec3d gradient() const {
    Vec3d sum{0, 0, 0};
    for (int i = 0; i < edge_count_; ++i) {
      const Vec3d edge = edges_[i];
      const double squared = dot(edge, edge);
      if (!(squared > 0)) continue;
      const Vec3d by_edge =
          scale_ * cross(edges_[(i + 1) % 3], edges_[(i + 2) % 3]) - (value_ / squared) * edge;
      if (corner_.neighbours[i] == own_) return by_edge;
      sum = sum - by_edge;
    }
    return sum;
  }

 private:
  CornerShape corner_;
  int own_;
  int edge_count_;
  Vec3d edges_[3];
  double scale_ = 0;
  double value_ = 0;
};

/// The rule that raises the least scaled Jacobians of a node's ball: a Newton step on the sum of
/// powers of what its corners lack, of whose second derivatives the part that is certainly positive
/// is taken. No corner falls below the least of the ball, nor does an element become invalid that
/// was valid. The least alone would have kinks, at which a node's search ends too early. Source:
/// Freitag Diachin, Knupp, Munson, Shontz 2006, "A comparison of two optimization methods for mesh
/// quality improvement".
///
/// cost   the ball's corners with derivatives, and their values for each length
template <class Real>
struct RaiseVisit {
  static constexpr int kLengths = 4;
  static constexpr double kShorter = 0.4;
  static constexpr double kLeastGain = 1e-6;  // of the energy

  Surroundings around;
  DisplacementLimit<Real> displacement_limit;
  const std::uint8_t* poor;  // by node: whether an element of its ball is
  Vec3<Real>* positions;
  double least = 0;  // of the mesh
  double below = 0;  // what lacks nothing
  int power = 4;

  MESHSMOOTH_HD SweepStats operator()(std::size_t node) const {
    const Vec3<Real> before = positions[node];
    if (poor[node] != 0 && around.fixed[node] == 0) positions[node] = raised(node);
    return stats_of_move(before, positions[node], false);
  }

  /// Of an element as it is.
  [[nodiscard]] MESHSMOOTH_HD double scaled_jacobian_of(std::size_t e) const {
    Vec3d corners[kMaxCorners];
    const ElementShape& shape = corners_of(e, around.node_count, {}, corners);
    if (shape.dimension == 3 && shape.node_count == 4) {
      return finite_measure(measure_tetrahedron(corners).scaled_jacobian);
    }
    const auto get = [&](int n) { return corners[n]; };
    double lowest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < shape.corner_count; ++k) {
      const double value =
          scaled_jacobian(shape, corner_geometry(shape, k, get, around.reference_of(e)));
      if (!(value >= lowest)) lowest = value;
    }
    return finite_measure(lowest);
  }

 private:
  /// What a corner lacks, at most 1 where none is below the mesh's least.
  [[nodiscard]] MESHSMOOTH_HD double lack(double value) const {
    return value < below ? (below - value) / (below - least) : 0;
  }
  [[nodiscard]] MESHSMOOTH_HD double energy_of(double lack) const {
    double energy = 1;
    for (int n = 0; n < power; ++n) energy *= lack;
    return energy;
  }

  [[nodiscard]] MESHSMOOTH_HD Vec3<Real> raised(std::size_t node) const {
    const Vec3<Real> own = positions[node];
    BallDerivatives at;
    double floor = least;
    for_each_corner(node, own, [&](const JacobianCorner& corner) {
      const double lacking = lack(corner.value());
      if (corner.value() < floor) floor = corner.value();
      if (!(lacking > 0)) return true;
      const double energy = energy_of(lacking);
      const Vec3d by_move = (1 / (below - least)) * corner.gradient();
      const double slope = power * energy / lacking;
      const double curvature = (power - 1) * slope / lacking;
      at.energy += energy;
      at.gradient = at.gradient - slope * by_move;
      at.xx += curvature * by_move.x * by_move.x;
      at.yy += curvature * by_move.y * by_move.y;
      at.zz += curvature * by_move.z * by_move.z;
      at.xy += curvature * by_move.x * by_move.y;
      at.xz += curvature * by_move.x * by_move.z;
      at.yz += curvature * by_move.y * by_move.z;
      at.diagonal += slope * (below - least) * dot(by_move, by_move);
      return true;
    });
    if (!(at.energy > 0)) return own;
    at.xx += at.diagonal;
    at.yy += at.diagonal;
    at.zz += at.diagonal;
    Vec3d move = newton(node, at).direction;
    for (int n = 0; n < kLengths; ++n, move = kShorter * move) {
      const Vec3<Real> candidate =
          project(around, displacement_limit, node, vec3_cast<Real>(vec3_cast<double>(own) + move));
      if (candidate == own) return own;
      const double enough = at.energy * (1 - kLeastGain);
      if (energy_at(node, candidate, floor, enough) < enough && is_allowed(node, candidate)) {
        return candidate;
      }
    }
    return own;
  }
  [[nodiscard]] MESHSMOOTH_HD NewtonStep newton(std::size_t node, const BallDerivatives& at) const {
    const NodeConstraint* const constraint = around.sliding.constraint(node);
    if (constraint == nullptr || constraint->off_target) {
      return around.surface() ? newton_step_in_plane(at, around.reference) : newton_step(at);
    }
    const Vec3d direction =
        constraint->curved()
            ? direction_on_facets(around.sliding, node, QuietPositions<Real>{positions})
            : constraint->direction;
    return constraint->along() ? newton_step_on_line(at, direction)
                               : newton_step_in_plane(at, direction);
  }
  /// Infinite if a corner is below `floor`; any value of at least `most` where that is reached.
  [[nodiscard]] MESHSMOOTH_HD double energy_at(std::size_t node, Vec3<Real> position, double floor,
                                               double most) const {
    double energy = 0;
    for_each_corner(node, position, [&](const JacobianCorner& corner) {
      energy = corner.value() >= floor ? energy + energy_of(lack(corner.value()))
                                       : std::numeric_limits<double>::infinity();
      return energy < most;
    });
    return energy;
  }

  MESHSMOOTH_HD const ElementShape& corners_of(std::size_t e, std::size_t node, Vec3<Real> position,
                                               Vec3d* corners) const {
    const ElementView element = around.elements[e];
    for (int n = 0; n < element.shape->node_count; ++n) {
      const auto id = static_cast<std::size_t>(element.nodes[n]);
      corners[n] = vec3_cast<double>(id == node ? position : positions[id]);
    }
    return *element.shape;
  }
  /// Visits the corners at which `node` is, or to whose edges it belongs, while `visit` is true.
  template <class Visit>
  MESHSMOOTH_HD void for_each_corner(std::size_t node, Vec3<Real> position,
                                     const Visit& visit) const {
    const ElementId* const end = around.balls.end(node);
    for (const ElementId* e = around.balls.begin(node); e < end; ++e) {
      Vec3d corners[kMaxCorners];
      const ElementShape& shape = corners_of(*e, node, position, corners);
      const NodeId* const nodes = around.elements[*e].nodes;
      int own = 0;
      while (static_cast<std::size_t>(nodes[own]) != node) ++own;
      for (int k = 0; k < shape.corner_count; ++k) {
        const JacobianCorner corner(shape, k, own, corners, around.reference_of(*e));
        if (corner.has_node() && !visit(corner)) return;
      }
    }
  }
  [[nodiscard]] MESHSMOOTH_HD bool is_allowed(std::size_t node, Vec3<Real> position) const {
    if (!keeps_facets(SingleThread{}, around.sliding, QuietPositions<Real>{positions}, node,
                      position)) {
      return false;
    }
    const ElementId* const end = around.balls.end(node);
    for (const ElementId* e = around.balls.begin(node); e < end; ++e) {
      if (!is_certain(*e, node, position) && is_certain(*e, node, positions[node])) return false;
    }
    return true;
  }
  /// Whether an element is valid for certain.
  [[nodiscard]] MESHSMOOTH_HD bool is_certain(std::size_t e, std::size_t node,
                                              Vec3<Real> position) const {
    Vec3d corners[kMaxCorners];
    const ElementShape& shape = corners_of(e, node, position, corners);
    const ElementMeasure measure = measure_element(shape, corners, around.reference_of(e));
    return !measure.inverted && !measure.degenerate;
  }
};

}  // namespace meshsmooth::detail
