#include "smooth/second_order/cure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "mesh/curved_jacobian.hpp"
#include "mesh/parallel.hpp"

namespace meshsmooth::detail {
namespace {

/// Coefficients of an element that moves aims at, as a share of its mean: below it is visited.
constexpr double kWanted = 0.15;
constexpr int kMostSweeps = 60;
constexpr int kVisitsPerQuestion = 64;  // a visit takes up to 2 ms, among hexahedra

/// An element of the part of the mesh that is cured.
struct Patient {
  ElementType type;
  std::span<const NodeId> nodes;
  Vec3d reference;
  double scale = 1;  // of its coefficients
  bool valid = false;
};

/// How coefficients change with the position of a node.
struct LinearCoefficient {
  double value;
  Vec3d gradient;
};

template <class Real>
class Cure {
 public:
  Cure(const TopologyView& topology, std::span<const std::uint8_t> held,
       const SurfaceOrientation& orientation, std::span<Vec3<Real>> positions)
      : topology_(topology), held_(held), orientation_(orientation), positions_(positions) {}

  std::int64_t run(const std::function<bool()>& goes_on) {
    std::vector<std::uint8_t> chosen = invalid_nodes();
    if (std::ranges::none_of(chosen, [](std::uint8_t c) { return c != 0; })) return 0;
    for (int ring = 0; ring < 2; ++ring) add_ring(chosen);
    gather(chosen);
    const std::vector<Vec3<Real>> before(positions_.begin(), positions_.end());
    int idle = 0;
    double best = lowest();
    bool ends = false;
    for (int sweep = 0; sweep < kMostSweeps && best < kWanted && idle < 6 && !ends; ++sweep) {
      // Escobar's choice: no smaller than what makes the lowest coefficient tell.
      const double low = lowest();
      delta_ = low < kWanted ? std::sqrt(0.25 * kWanted * (kWanted - low)) : 0.05 * kWanted;
      for (std::size_t n = 0; n < nodes_.size() && !ends; ++n) {
        visit(nodes_[n]);
        ends = n % kVisitsPerQuestion == 0 && !goes_on();
      }
      const double now = lowest();
      idle = now > best + 1e-3 ? 0 : idle + 1;
      best = std::max(best, now);
    }
    std::int64_t moved = 0;
    for (std::size_t n = 0; n < before.size(); ++n) {
      if (!(before[n] == positions_[n])) ++moved;
    }
    return moved;
  }

 private:
  template <class Visit>
  void for_each_element(const Visit& visit) const {
    std::size_t element = 0;
    for (const ElementBlockView& block : topology_.blocks) {
      const std::size_t width = element_width(block.type);
      for (std::size_t at = 0; at < block.nodes.size(); at += width) {
        visit(block.type, block.nodes.subspan(at, width), element++);
      }
    }
  }

  /// All nodes of elements that are not valid.
  [[nodiscard]] std::vector<std::uint8_t> invalid_nodes() const {
    std::vector<std::uint8_t> chosen(positions_.size());
    std::size_t first = 0;
    for (const ElementBlockView& block : topology_.blocks) {
      const std::size_t width = element_width(block.type);
      std::vector<std::uint8_t> wrong(block.element_count());
      parallel_for_ranges(wrong.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t e = begin; e < end; ++e) {
          const Patient patient{block.type, block.nodes.subspan(e * width, width),
                                orientation_.reference(first + e)};
          wrong[e] = is_valid(patient) ? 0 : 1;
        }
      });
      for (std::size_t e = 0; e < wrong.size(); ++e) {
        for (std::size_t n = 0; wrong[e] != 0 && n < width; ++n) {
          chosen[static_cast<std::size_t>(block.nodes[e * width + n])] = 1;
        }
      }
      first += block.element_count();
    }
    return chosen;
  }

  void add_ring(std::vector<std::uint8_t>& chosen) const {
    const std::vector<std::uint8_t> inner = chosen;
    for_each_element([&](ElementType, std::span<const NodeId> nodes, std::size_t) {
      const bool touches = std::ranges::any_of(
          nodes, [&](NodeId node) { return inner[static_cast<std::size_t>(node)] != 0; });
      for (const NodeId node : nodes) {
        if (touches) chosen[static_cast<std::size_t>(node)] = 1;
      }
    });
  }

  /// The nodes that may move, and all elements at them.
  void gather(const std::vector<std::uint8_t>& chosen) {
    const auto moves = [&](NodeId node) {
      const auto n = static_cast<std::size_t>(node);
      return chosen[n] != 0 && held_[n] == 0;
    };
    for_each_element([&](ElementType type, std::span<const NodeId> nodes, std::size_t element) {
      if (std::ranges::none_of(nodes, moves)) return;
      Patient patient{type, nodes, orientation_.reference(element)};
      patient.valid = is_valid(patient);
      std::array<double, kMostJacobianCoefficients> found{};
      const std::size_t count = coefficients(patient, found);
      double sum = 0;
      for (std::size_t k = 0; k < count; ++k) sum += std::abs(found[k]);
      patient.scale = sum > 0 ? sum / static_cast<double>(count) : 1;
      for (const NodeId node : nodes) {
        if (moves(node)) elements_at_[node].push_back(patients_.size());
      }
      patients_.push_back(patient);
    });
    for (const auto& [node, elements] : elements_at_) nodes_.push_back(node);
    std::ranges::sort(nodes_);
  }

  [[nodiscard]] std::span<const Vec3<Real>> positions() const { return positions_; }
  [[nodiscard]] bool is_valid(const Patient& patient) const {
    return detail::is_valid(patient.type, patient.nodes, positions(), patient.reference);
  }
  std::size_t coefficients(const Patient& patient,
                           std::array<double, kMostJacobianCoefficients>& found) const {
    const auto nodes = positions_of(patient.nodes, positions());
    return jacobian_coefficients(patient.type, nodes.data(), patient.reference, found.data());
  }

  /// The lowest coefficient of all elements, over their scale.
  [[nodiscard]] double lowest() const {
    return parallel_reduce(
        patients_.size(), HUGE_VAL,
        [&](std::size_t p) {
          std::array<double, kMostJacobianCoefficients> found{};
          const std::size_t count = coefficients(patients_[p], found);
          return *std::min_element(found.begin(),
                                   found.begin() + static_cast<std::ptrdiff_t>(count)) /
                 patients_[p].scale;
        },
        [](double a, double b) { return std::min(a, b); });
  }

  /// The coefficients of the elements at a node, and their gradients by its position: exact
  /// differences, for they are linear in it.
  void linearize(NodeId node) {
    terms_.clear();
    std::array<double, kMostJacobianCoefficients> at{}, beside{};
    for (const std::size_t p : elements_at_.at(node)) {
      const Patient& patient = patients_[p];
      auto nodes = positions_of(patient.nodes, positions());
      const auto own =
          static_cast<std::size_t>(std::ranges::find(patient.nodes, node) - patient.nodes.begin());
      const double step = norm(nodes[1] - nodes[0]);
      const std::size_t count =
          jacobian_coefficients(patient.type, nodes.data(), patient.reference, at.data());
      const std::size_t first = terms_.size();
      for (std::size_t k = 0; k < count; ++k) {
        terms_.push_back({at[k] / patient.scale, {0, 0, 0}});
      }
      for (const auto axis : {&Vec3d::x, &Vec3d::y, &Vec3d::z}) {
        const Vec3d there = nodes[own];
        nodes[own].*axis += step;
        jacobian_coefficients(patient.type, nodes.data(), patient.reference, beside.data());
        nodes[own] = there;
        for (std::size_t k = 0; k < count; ++k) {
          terms_[first + k].gradient.*axis = (beside[k] - at[k]) / (step * patient.scale);
        }
      }
    }
  }

  [[nodiscard]] double energy(Vec3d move) const {
    double sum = 0;
    for (const LinearCoefficient& term : terms_) {
      const double c = term.value + dot(term.gradient, move);
      sum += 2 / (c + std::sqrt(c * c + 4 * delta_ * delta_));
    }
    return sum;
  }

  /// A step of Newton's method from `move`; the function is convex.
  [[nodiscard]] Vec3d newton_step(Vec3d move) const {
    Vec3d g{0, 0, 0};
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
    for (const LinearCoefficient& term : terms_) {
      const double c = term.value + dot(term.gradient, move);
      const double root = std::sqrt(c * c + 4 * delta_ * delta_);
      const double h = (c + root) / 2;
      const double second = 2 / (root * root * root);
      const Vec3d a = term.gradient;
      g += (-1 / (h * root)) * a;
      xx += second * a.x * a.x, xy += second * a.x * a.y, xz += second * a.x * a.z;
      yy += second * a.y * a.y, yz += second * a.y * a.z, zz += second * a.z * a.z;
    }
    const double small = 1e-6 * (xx + yy + zz);  // in a plane one direction does not count
    xx += small, yy += small, zz += small;
    const Vec3d r0{xx, xy, xz}, r1{xy, yy, yz}, r2{xz, yz, zz};
    const double determinant = dot(r0, cross(r1, r2));
    if (!(determinant > 0)) return {0, 0, 0};
    const Vec3d s = -1 / determinant * g;
    return s.x * cross(r1, r2) + s.y * cross(r2, r0) + s.z * cross(r0, r1);
  }

  void visit(NodeId node) {
    linearize(node);
    const bool poor = std::ranges::any_of(
        terms_, [](const LinearCoefficient& term) { return term.value < kWanted; });
    if (!poor) return;
    Vec3d move{0, 0, 0};
    double now = energy(move);
    for (int iteration = 0; iteration < 6; ++iteration) {
      Vec3d step = newton_step(move);
      double next = energy(move + step);
      for (int k = 0; k < 10 && !(next < now); ++k) {
        step = 0.5 * step;
        next = energy(move + step);
      }
      if (!(next < now * (1 - 1e-6))) break;
      move += step;
      now = next;
    }
    take(node, move);
  }

  /// Moves the node as far as valid elements stay so.
  void take(NodeId node, Vec3d move) {
    Vec3<Real>& position = positions_[static_cast<std::size_t>(node)];
    const Vec3<Real> before = position;
    for (int k = 0; k < 6; ++k, move = 0.5 * move) {
      position = vec3_cast<Real>(vec3_cast<double>(before) + move);
      const auto& elements = elements_at_.at(node);
      const bool spoils = std::ranges::any_of(
          elements, [&](std::size_t p) { return patients_[p].valid && !is_valid(patients_[p]); });
      if (spoils) continue;
      for (const std::size_t p : elements) patients_[p].valid |= is_valid(patients_[p]);
      return;
    }
    position = before;
  }

  const TopologyView& topology_;
  std::span<const std::uint8_t> held_;
  const SurfaceOrientation& orientation_;
  std::span<Vec3<Real>> positions_;
  std::vector<Patient> patients_;
  std::unordered_map<NodeId, std::vector<std::size_t>> elements_at_;
  std::vector<NodeId> nodes_;
  std::vector<LinearCoefficient> terms_;
  double delta_ = 0;
};

}  // namespace

template <class Real>
std::int64_t cure(const TopologyView& topology, std::span<const std::uint8_t> held,
                  const SurfaceOrientation& orientation, std::span<Vec3<Real>> positions,
                  const std::function<bool()>& goes_on) {
  return Cure<Real>(topology, held, orientation, positions).run(goes_on);
}

template std::int64_t cure(const TopologyView&, std::span<const std::uint8_t>,
                           const SurfaceOrientation&, std::span<Vec3f>,
                           const std::function<bool()>&);
template std::int64_t cure(const TopologyView&, std::span<const std::uint8_t>,
                           const SurfaceOrientation&, std::span<Vec3d>,
                           const std::function<bool()>&);

}  // namespace meshsmooth::detail
