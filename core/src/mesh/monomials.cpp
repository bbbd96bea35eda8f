#include "mesh/monomials.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace meshsmooth::detail {
namespace {

Exponents sum(Exponents a, const Exponents& b) {
  for (std::size_t c = 0; c < a.size(); ++c) a[c] = static_cast<std::int8_t>(a[c] + b[c]);
  return a;
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

}  // namespace

std::vector<double> shares_of(const Monomials& monomials, const Groups& groups) {
  std::vector<double> shares;
  for (const Exponents& exponents : monomials.all()) shares.push_back(share_of(exponents, groups));
  return shares;
}

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

Monomials divide(const Monomials& of, std::size_t coordinate,
                 std::vector<JacobianPlan::Weight>& weights) {
  Monomials result;
  std::vector<JacobianPlan::Weight> kept;
  for (const JacobianPlan::Weight& weight : weights) {
    Exponents exponents = of.all()[weight.to];
    if (exponents[coordinate]-- < 1) continue;
    kept.push_back({result.index(exponents), weight.from, weight.by});
  }
  weights = std::move(kept);
  return result;
}

std::vector<std::vector<JacobianPlan::Line>> find_lines(Monomials& monomials,
                                                        const Groups& groups) {
  std::vector<std::vector<JacobianPlan::Line>> edges;
  visit_edges(groups, [&](std::size_t i, std::size_t j) {
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
    edges.push_back(std::move(lines));
  });
  return edges;
}

std::map<std::vector<bool>, std::uint16_t> find_vertices(const Monomials& monomials,
                                                         const Groups& groups) {
  std::map<std::vector<bool>, std::uint16_t> vertices;
  for (std::uint16_t m = 0; m < monomials.size(); ++m) {
    std::vector<bool> used;
    for (const std::int8_t exponent : monomials.all()[m]) used.push_back(exponent != 0);
    if (std::ranges::count(used, true) == std::ssize(groups)) vertices[used] = m;
  }
  return vertices;
}

}  // namespace meshsmooth::detail
