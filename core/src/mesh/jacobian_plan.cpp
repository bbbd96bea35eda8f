#include "mesh/jacobian_plan.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <span>
#include <utility>

#include "mesh/monomials.hpp"

namespace meshsmooth::detail {
namespace {

using Row = std::map<int, double>;  // a linear combination of nodes

/// The coordinates of a linear element's corners: group by group the one that is 1.
struct Frame {
  Groups groups;
  std::vector<std::vector<int>> corners;
};

Frame frame_of(ElementType linear) {
  switch (linear) {
    case ElementType::triangle:
      return {{3}, {{0}, {1}, {2}}};
    case ElementType::quad:
      return {{2, 2}, {{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    case ElementType::tetrahedron:
      return {{4}, {{0}, {1}, {2}, {3}}};
    case ElementType::wedge:  // turned so that a valid one has a positive Jacobian
      return {{3, 2}, {{0, 0}, {2, 0}, {1, 0}, {0, 1}, {2, 1}, {1, 1}}};
    default:
      return {
          {2, 2, 2},
          {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
  }
}

/// Exponents of the square of a corner's coordinates, or of the product of several corners', whose
/// mean the point is.
Exponents exponents_of(const Frame& frame, std::span<const std::int8_t> corners) {
  Exponents result{};
  int first = 0;
  for (std::size_t g = 0; g < frame.groups.size(); ++g) {
    std::vector<int> uses(static_cast<std::size_t>(frame.groups[g]), 0);
    for (const std::int8_t corner : corners) {
      ++uses[static_cast<std::size_t>(frame.corners[static_cast<std::size_t>(corner)][g])];
    }
    for (std::size_t c = 0; c < uses.size(); ++c) {
      result[static_cast<std::size_t>(first) + c] =
          static_cast<std::int8_t>(2 * uses[c] / static_cast<int>(corners.size()));
    }
    first += frame.groups[g];
  }
  return result;
}

/// The points of the full element of second order, by the nodes of a type.
std::map<Exponents, Row> find_points(ElementType type, const Frame& frame) {
  std::map<Exponents, Row> points;
  const bool pyramid = linear_type(type) == ElementType::pyramid;
  const ElementType full = pyramid || linear_type(type) == ElementType::hexahedron
                               ? ElementType::hexahedron27
                           : linear_type(type) == ElementType::wedge ? ElementType::wedge18
                           : linear_type(type) == ElementType::quad  ? ElementType::quad9
                                                                     : type;
  const int corner_count = element_shape(full).node_count;
  const auto node_of_corner = [&](int corner) { return pyramid ? std::min(corner, 4) : corner; };
  for (std::int8_t corner = 0; corner < corner_count; ++corner) {
    points[exponents_of(frame, std::span(&corner, 1))] = {{node_of_corner(corner), 1.0}};
  }
  const std::span<const MidNode> mids = mid_nodes(type);
  const int own_corner_count = element_shape(type).node_count;
  for (const MidNode& mid : mid_nodes(full)) {
    const auto parents = std::span(mid.corners).first(static_cast<std::size_t>(mid.corner_count));
    Row& row = points[exponents_of(frame, parents)];
    std::map<int, int> wanted;  // a pyramid's apex is four corners
    for (const std::int8_t corner : parents) ++wanted[node_of_corner(corner)];
    if (wanted.size() == 1) {
      row = {{wanted.begin()->first, 1.0}};
      continue;
    }
    for (std::size_t m = 0; m < mids.size() && row.empty(); ++m) {
      if (mids[m].corner_count != mid.corner_count) continue;
      std::map<int, int> has;
      for (int c = 0; c < mids[m].corner_count; ++c)
        ++has[mids[m].corners[static_cast<std::size_t>(c)]];
      if (has == wanted) row = {{own_corner_count + static_cast<int>(m), 1.0}};
    }
    if (!row.empty()) continue;
    // As the serendipity element has it: of a face -1/4 of the corners and 1/2 of the edges, of the
    // middle -1/4 and 1/4.
    for (const std::int8_t corner : parents) row[node_of_corner(corner)] -= 0.25;
    for (const MidNode& edge : mid_nodes(full)) {
      if (edge.corner_count != 2) continue;
      const auto on = [&](std::int8_t corner) {
        return std::find(parents.begin(), parents.end(), corner) != parents.end();
      };
      if (!on(edge.corners[0]) || !on(edge.corners[1])) continue;
      const Row& from = points.at(exponents_of(frame, std::span(edge.corners).first(2)));
      for (const auto& [node, by] : from) row[node] += (mid.corner_count == 4 ? 0.5 : 0.25) * by;
    }
  }
  return points;
}

/// Turns values at the points into coefficients of monomials, group by group: on an edge of a group
/// 4 m - a - b, twice the Bézier coefficient.
void to_monomials(std::map<Exponents, Row>& points, const Groups& groups) {
  int first = 0;
  for (const int count : groups) {
    const std::map<Exponents, Row> values = points;
    for (auto& [exponents, row] : points) {
      for (int i = first; i < first + count; ++i) {
        for (int j = i + 1; j < first + count; ++j) {
          if (exponents[static_cast<std::size_t>(i)] != 1 ||
              exponents[static_cast<std::size_t>(j)] != 1)
            continue;
          for (auto& [node, by] : row) by *= 4;
          for (const auto& [keeps, loses] : {std::pair(i, j), std::pair(j, i)}) {
            Exponents end = exponents;
            end[static_cast<std::size_t>(keeps)] = 2;
            end[static_cast<std::size_t>(loses)] = 0;
            for (const auto& [node, by] : values.at(end)) row[node] -= by;
          }
        }
      }
    }
    first += count;
  }
}

/// The corners of the linear element, by edges of each group; of a group of two there is one edge.
std::vector<std::vector<std::pair<std::size_t, std::size_t>>> corners_by_edges(
    const Groups& groups) {
  std::vector<std::vector<std::pair<std::size_t, std::size_t>>> corners = {{}};
  std::size_t first = 0;
  for (const int count : groups) {
    const std::size_t end = first + static_cast<std::size_t>(count);
    const auto before = std::exchange(corners, {});
    for (const auto& corner : before) {
      for (std::size_t vertex = first; vertex < (count == 2 ? first + 1 : end); ++vertex) {
        corners.push_back(corner);
        for (std::size_t other = first; other < end; ++other) {
          if (other != vertex) corners.back().push_back(std::minmax(vertex, other));
        }
      }
    }
    first = end;
  }
  return corners;
}

void add_frames(JacobianPlan& plan, const Monomials& position, Monomials& jacobian,
                const Groups& groups, bool pyramid) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> indices;
  std::vector<Monomials> along;
  visit_edges(groups, [&](std::size_t i, std::size_t j) {
    indices[{i, j}] = along.size();
    JacobianPlan::Direction direction;
    Monomials monomials = differentiate(position, j, i, direction.weights);
    // Those along the base shrink towards the apex as their product in the Jacobian does.
    if (pyramid && j < 4) monomials = divide(monomials, 4, direction.weights);
    direction.shares = shares_of(monomials, groups);
    for (const auto& [used, m] : find_vertices(monomials, groups)) direction.vertices.push_back(m);
    direction.edges = find_lines(monomials, groups);
    plan.directions.push_back(std::move(direction));
    along.push_back(std::move(monomials));
  });
  for (const auto& corner : corners_by_edges(groups)) {
    JacobianPlan::Frame& frame = plan.frames.emplace_back();
    for (const auto& edge : corner) frame.directions.push_back(indices.at(edge));
    Monomials product = along[frame.directions[0]];
    for (std::size_t d = 1; d < frame.directions.size(); ++d) {
      product = multiply(product, along[frame.directions[d]], frame.products.emplace_back());
    }
    for (JacobianPlan::Product& last : frame.products.back()) {
      last.to = jacobian.index(product.all()[last.to]);
    }
  }
}

/// What a derivative has of each node.
std::vector<double> find_shares_of_nodes(const JacobianPlan& plan, std::size_t axis,
                                         std::size_t node_count) {
  const std::size_t count = plan.derivative_shares[axis].size();
  std::vector<double> shares(node_count * count);
  for (const JacobianPlan::Weight& of_position : plan.control) {
    for (const JacobianPlan::Weight& weight : plan.derivatives[axis]) {
      if (weight.from != of_position.to) continue;
      shares[of_position.from * count + weight.to] += weight.by * of_position.by;
    }
  }
  return shares;
}

JacobianPlan make_plan(ElementType type) {
  JacobianPlan plan;
  const Frame frame = frame_of(linear_type(type));
  auto points = find_points(type, frame);
  to_monomials(points, frame.groups);
  Monomials position;
  for (const auto& [exponents, row] : points) {
    const std::uint16_t to = position.index(exponents);
    for (const auto& [node, by] : row) {
      if (by != 0) plan.control.push_back({to, static_cast<std::uint16_t>(node), by});
    }
  }
  plan.control_count = position.size();

  std::vector<Monomials> derivatives;
  std::size_t first = 0;
  for (const int count : frame.groups) {
    for (std::size_t c = first + 1; c < first + static_cast<std::size_t>(count); ++c) {
      const std::size_t axis = derivatives.size();
      derivatives.push_back(differentiate(position, c, first, plan.derivatives[axis]));
      plan.derivative_shares[axis] = shares_of(derivatives.back(), frame.groups);
      plan.of_node[axis] = find_shares_of_nodes(plan, axis, element_width(type));
    }
    first += static_cast<std::size_t>(count);
  }
  const std::size_t last = derivatives.size() - 1;
  Monomials jacobian = multiply(derivatives[last - 1], derivatives[last], plan.cross);
  plan.cross_count = jacobian.size();
  if (last == 2) jacobian = multiply(derivatives[0], jacobian, plan.jacobian);
  if (linear_type(type) == ElementType::pyramid) {
    jacobian = divide_by_square(jacobian, 4, plan.jacobian);
  }
  plan.shares = shares_of(jacobian, frame.groups);

  plan.edges = find_lines(jacobian, frame.groups);
  for (const auto& [used, m] : find_vertices(jacobian, frame.groups)) plan.vertices.push_back(m);
  add_frames(plan, position, jacobian, frame.groups, linear_type(type) == ElementType::pyramid);
  return plan;
}

}  // namespace

const JacobianPlan& jacobian_plan(ElementType type) {
  static const auto plans = [] {
    std::array<std::unique_ptr<const JacobianPlan>, kElementTypeCount> all;
    for (const ElementType each : kElementTypes) {
      if (is_second_order(each)) {
        all[static_cast<std::size_t>(each)] = std::make_unique<JacobianPlan>(make_plan(each));
      }
    }
    return all;
  }();
  return *plans[static_cast<std::size_t>(type)];
}

}  // namespace meshsmooth::detail
