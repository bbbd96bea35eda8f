#pragma once

// The optimizer as a textbook has it: one node after the other, down the gradient of its
// ball's energy, with backtracking. A reference for the product, and the floor for its speed.

#include "support/oracle.hpp"

namespace meshsmooth::test::oracle {

/// A corner of an element type: a node, its neighbours along edges, and the inverse of the
/// ideal edge vectors. Of a surface element the third vector is the unit normal.
struct Corner {
  int node;
  std::vector<int> around;
  Eigen::Matrix3d ideal_inverse;
  double weight = 1;  // those of an element are 1 together
};

/// The corners at which as many edges meet as the element has dimensions.
inline std::vector<Corner> find_corners(ElementType type) {
  Points ideal;
  for (const Vec3d& p : ideal_points(type)) ideal.push_back(to_point(p));
  const std::size_t dimension = is_surface(type) ? 2 : 3;
  std::vector<Corner> result;
  for (int node = 0; node < static_cast<int>(ideal.size()); ++node) {
    std::vector<int> around;
    for (const std::set<int>& edge : local_edges(type)) {
      if (edge.contains(node)) around.push_back(*edge.begin() + *edge.rbegin() - node);
    }
    if (around.size() != dimension) continue;  // a pyramid's apex
    Eigen::Matrix3d w = Eigen::Matrix3d::Identity();
    const auto fill = [&] {
      for (std::size_t k = 0; k < dimension; ++k) w.col(k) = ideal[around[k]] - ideal[node];
    };
    fill();
    if (w.determinant() < 0) std::swap(around[0], around[1]);
    fill();
    result.push_back({node, around, w.inverse()});
  }
  for (Corner& corner : result) corner.weight = 1.0 / static_cast<double>(result.size());
  return result;
}

inline const std::vector<Corner>& corners_of(ElementType type) {
  static const std::vector<std::vector<Corner>> all = [] {
    std::vector<std::vector<Corner>> table;
    for (const ElementType each : kLinearTypes) table.push_back(find_corners(each));
    return table;
  }();
  return all[static_cast<std::size_t>(type)];
}

/// The weighted sum of f^p, and its gradient by the place of one node. Infinite where a
/// determinant is not positive.
struct Energy {
  double value = 0;
  Point gradient = Point::Zero();
};

/// Adds what one element gives to the energy, at the corners that `node` changes. Surface
/// elements lie in a plane z = const.
inline void add_energy(const Element& element, NodeId node, const Points& x, double p,
                       Energy& energy) {
  const int dimension = is_surface(element.type) ? 2 : 3;
  for (const Corner& corner : corners_of(element.type)) {
    Point weight = Point::Zero();  // of the node in each edge vector
    Eigen::Matrix3d a = Eigen::Matrix3d::Identity();
    for (int k = 0; k < dimension; ++k) {
      const NodeId end = element.nodes[corner.around[k]];
      a.col(k) = x[end] - x[element.nodes[corner.node]];
      if (end == node) weight[k] = 1;
      if (element.nodes[corner.node] == node) weight[k] = -1;
    }
    if (weight.isZero()) continue;
    const Eigen::Matrix3d t = a * corner.ideal_inverse;
    const double det = t.determinant();
    if (!(det > 0)) {
      energy.value = HUGE_VAL;
      return;
    }
    const double scale = dimension * std::pow(det, 2.0 / dimension);
    const double f = (t.squaredNorm() - (3 - dimension)) / scale;
    const Eigen::Matrix3d by_t =
        2 / scale * t - 2.0 / dimension * f * t.inverse().transpose().eval();
    const Eigen::Matrix3d by_a = by_t * corner.ideal_inverse.transpose();
    energy.value += corner.weight * std::pow(f, p);
    energy.gradient += corner.weight * p * std::pow(f, p - 1) * (by_a * weight);
  }
}

/// The p-mean of f over all corners with a free node.
inline double mean_energy(const Mesh& mesh, double p) {
  const Points x = to_points(mesh);
  const std::vector<bool> held = held_nodes(mesh);
  double sum = 0, weight = 0;
  for (const Element& element : elements(mesh)) {
    const int dimension = is_surface(element.type) ? 2 : 3;
    for (const Corner& corner : corners_of(element.type)) {
      bool free = !held[element.nodes[corner.node]];
      Eigen::Matrix3d a = Eigen::Matrix3d::Identity();
      for (int k = 0; k < dimension; ++k) {
        const NodeId end = element.nodes[corner.around[k]];
        a.col(k) = x[end] - x[element.nodes[corner.node]];
        free = free || !held[end];
      }
      if (!free) continue;
      const Eigen::Matrix3d t = a * corner.ideal_inverse;
      const double det = t.determinant();
      if (!(det > 0)) return HUGE_VAL;
      const double f =
          (t.squaredNorm() - (3 - dimension)) / (dimension * std::pow(det, 2.0 / dimension));
      sum += corner.weight * std::pow(f, p);
      weight += corner.weight;
    }
  }
  return std::pow(sum / weight, 1 / p);
}

/// Gradient descent, ball by ball, of a valid mesh.
class Descent {
 public:
  Descent(const Mesh& mesh, double p)
      : all_(elements(mesh)), held_(held_nodes(mesh)), p_(p), steps_(mesh.node_count(), 0) {
    for (const auto& ball : balls(mesh)) balls_.emplace_back(ball.begin(), ball.end());
  }

  [[nodiscard]] Energy energy(NodeId node, const Points& x) const {
    Energy sum;
    for (const std::int64_t e : balls_[node]) add_energy(all_[e], node, x, p_, sum);
    return sum;
  }

  /// Visits every free node once.
  void sweep(Points& x) {
    for (std::size_t n = 0; n < x.size(); ++n) {
      if (!held_[n]) visit(static_cast<NodeId>(n), x);
    }
  }

 private:
  void visit(NodeId node, Points& x) {
    const Energy before = energy(node, x);
    const double slope = before.gradient.norm();
    if (!(slope > 0) || !std::isfinite(before.value)) return;
    const Point start = x[node];
    const Point down = -before.gradient / slope;
    double& step = steps_[node];
    if (step == 0) step = 0.25 * shortest_edge(node, x);
    for (int trial = 0; trial < 30; ++trial, step /= 2) {
      x[node] = start + step * down;
      // Armijo's rule.
      if (energy(node, x).value < before.value - 1e-4 * step * slope) {
        step *= 2;
        return;
      }
    }
    x[node] = start;
  }

  [[nodiscard]] double shortest_edge(NodeId node, const Points& x) const {
    double shortest = HUGE_VAL;
    for (const std::int64_t e : balls_[node]) {
      for (const NodeId other : all_[e].nodes) {
        if (other != node) shortest = std::min(shortest, (x[other] - x[node]).norm());
      }
    }
    return shortest;
  }

  std::vector<Element> all_;
  std::vector<std::vector<std::int64_t>> balls_;
  std::vector<bool> held_;
  double p_;
  std::vector<double> steps_;
};

}  // namespace meshsmooth::test::oracle
