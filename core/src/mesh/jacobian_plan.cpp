#include "mesh/jacobian_plan.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <span>
#include <utility>

namespace meshsmooth::detail {
namespace {

using Exponents =
    std::array<std::int8_t, 6>;     // of the coordinates of all groups, one after another
using Groups = std::vector<int>;    // coordinates in each
using Row = std::map<int, double>;  // a linear combination of nodes

/// Monomials by their exponents.
class Monomials {
 public:
  std::uint16_t index(const Exponents& exponents) {
    const auto [found, added] =
        index_.try_emplace(exponents, static_cast<std::uint16_t>(all_.size()));
    if (added) all_.push_back(exponents);
    return found->second;
  }
  [[nodiscard]] const std::vector<Exponents>& all() const { return all_; }
  [[nodiscard]] std::size_t size() const { return all_.size(); }

 private:
  std::map<Exponents, std::uint16_t> index_;
  std::vector<Exponents> all_;
};

Exponents sum(Exponents a, const Exponents& b) {
  for (std::size_t c = 0; c < a.size(); ++c) a[c] = static_cast<std::int8_t>(a[c] + b[c]);
  return a;
}

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

double factorial(int n) { return n < 2 ? 1 : n * factorial(n - 1); }

/// The share of a Bézier coefficient in the coefficient of its monomial.
double share_of(const Exponents& exponents, const Groups& groups) {
  double result = 1;
  std::size_t first = 0;
  for (const int count : groups) {
    int degree = 0;
    for (std::size_t c = first; c < first + static_cast<std::size_t>(count); ++c) {
      degree += exponents[c];
      result *= factorial(exponents[c]);
    }
    result /= factorial(degree);
    first += static_cast<std::size_t>(count);
  }
  return result;
}

std::vector<double> shares_of(const Monomials& monomials, const Groups& groups) {
  std::vector<double> shares;
  for (const Exponents& exponents : monomials.all()) shares.push_back(share_of(exponents, groups));
  return shares;
}

/// The derivative along the edge from the first coordinate of a group to another.
Monomials differentiate(const Monomials& of, std::size_t along, std::size_t against,
                        std::vector<JacobianPlan::Weight>& weights) {
  Monomials result;
  for (std::uint16_t from = 0; from < of.size(); ++from) {
    for (const auto& [coordinate, sign] : {std::pair(along, 1.0), std::pair(against, -1.0)}) {
      Exponents exponents = of.all()[from];
      const double power = exponents[coordinate];
      if (power == 0) continue;
      --exponents[coordinate];
      weights.push_back({result.index(exponents), from, sign * power});
    }
  }
  return result;
}

Monomials multiply(const Monomials& left, const Monomials& right,
                   std::vector<JacobianPlan::Product>& products) {
  Monomials result;
  for (std::uint16_t l = 0; l < left.size(); ++l) {
    for (std::uint16_t r = 0; r < right.size(); ++r) {
      products.push_back({result.index(sum(left.all()[l], right.all()[r])), l, r});
    }
  }
  return result;
}

/// Divides by the square of a coordinate: products below are 0, for the face has become a point.
Monomials divide_by_square(const Monomials& of, std::size_t coordinate,
                           std::vector<JacobianPlan::Product>& products) {
  Monomials result;
  std::vector<JacobianPlan::Product> kept;
  for (const JacobianPlan::Product& product : products) {
    Exponents exponents = of.all()[product.to];
    if (exponents[coordinate] < 2) continue;
    exponents[coordinate] = static_cast<std::int8_t>(exponents[coordinate] - 2);
    kept.push_back({result.index(exponents), product.left, product.right});
  }
  products = std::move(kept);
  return result;
}

/// The lines of monomials along an edge between two coordinates of a group.
std::vector<JacobianPlan::Line> find_lines(Monomials& monomials, std::size_t i, std::size_t j) {
  std::vector<JacobianPlan::Line> lines;
  for (std::size_t m = 0; m < monomials.size(); ++m) {
    Exponents exponents = monomials.all()[m];
    const std::int8_t total = static_cast<std::int8_t>(exponents[i] + exponents[j]);
    if (exponents[j] != 0 || total == 0) continue;  // one line begins at each of these
    JacobianPlan::Line line;
    for (std::int8_t at = 0; at <= total; ++at) {
      exponents[i] = static_cast<std::int8_t>(total - at);
      exponents[j] = at;
      line.push_back(monomials.index(exponents));
    }
    lines.push_back(std::move(line));
  }
  return lines;
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

  first = 0;
  for (const int count : frame.groups) {
    for (int step = 1; step < count; ++step) {
      for (std::size_t i = first;
           i + static_cast<std::size_t>(step) < first + static_cast<std::size_t>(count); ++i) {
        plan.edges.push_back(find_lines(jacobian, i, i + static_cast<std::size_t>(step)));
      }
    }
    first += static_cast<std::size_t>(count);
  }
  for (std::uint16_t m = 0; m < jacobian.size(); ++m) {
    std::size_t used = 0;
    for (const std::int8_t exponent : jacobian.all()[m]) used += exponent != 0 ? 1 : 0;
    if (used == frame.groups.size()) plan.vertices.push_back(m);
  }
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
