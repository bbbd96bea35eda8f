#pragma once

// Homogeneous polynomials in groups of barycentric coordinates, by their monomials: what a
// `JacobianPlan` is made from.

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "mesh/jacobian_plan.hpp"

namespace meshsmooth::detail {

using Exponents =
    std::array<std::int8_t, 6>;   // of the coordinates of all groups, one after another
using Groups = std::vector<int>;  // coordinates in each

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

/// The shares of Bézier coefficients in the coefficients of their monomials.
[[nodiscard]] std::vector<double> shares_of(const Monomials& monomials, const Groups& groups);

/// The derivative along the edge from one coordinate of a group to another.
[[nodiscard]] Monomials differentiate(const Monomials& of, std::size_t along, std::size_t against,
                                      std::vector<JacobianPlan::Weight>& weights);

[[nodiscard]] Monomials multiply(const Monomials& left, const Monomials& right,
                                 std::vector<JacobianPlan::Product>& products);

/// Divides by the square of a coordinate: products below are 0, for the face has become a point.
[[nodiscard]] Monomials divide_by_square(const Monomials& of, std::size_t coordinate,
                                         std::vector<JacobianPlan::Product>& products);

/// Divides by a coordinate: what lacks it is 0.
[[nodiscard]] Monomials divide(const Monomials& of, std::size_t coordinate,
                               std::vector<JacobianPlan::Weight>& weights);

/// Visits the pairs of coordinates of a group: edges of the linear element.
template <class Visit>
void visit_edges(const Groups& groups, const Visit& visit) {
  std::size_t first = 0;
  for (const int count : groups) {
    const std::size_t end = first + static_cast<std::size_t>(count);
    for (std::size_t step = 1; step < end - first; ++step) {
      for (std::size_t i = first; i + step < end; ++i) visit(i, i + step);
    }
    first = end;
  }
}

/// For each edge between two coordinates, the lines of monomials along it.
[[nodiscard]] std::vector<std::vector<JacobianPlan::Line>> find_lines(Monomials& monomials,
                                                                      const Groups& groups);

/// The monomials that are alone at a vertex, by the coordinates that are 1 there.
[[nodiscard]] std::map<std::vector<bool>, std::uint16_t> find_vertices(const Monomials& monomials,
                                                                       const Groups& groups);

}  // namespace meshsmooth::detail
