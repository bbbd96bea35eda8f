#include "smooth/second_order/cure.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "mesh/curved_jacobian.hpp"
#include "mesh/parallel.hpp"
#include "smooth/second_order/coefficient_energy.hpp"

namespace meshsmooth::detail {
namespace {

/// By goal.
struct Plan {
  double wanted;  // of the worst coefficient's nearness to the mean: elements below it are visited
  int rings;      // around the elements that are cured
  int most_sweeps;
  int most_idle;  // sweeps that do not raise the worst
  double weight;  // of the distance from the mean
};
constexpr Plan kPlans[] = {{0.15, 2, 60, 6, 0}, {0.65, 0, 20, 3, 1}};

constexpr std::size_t kVisitsPerQuestion = 64;  // a visit takes up to 2 ms, among hexahedra
constexpr std::size_t kShare = 16;              // elements or visits that a thread takes at a time

using Coefficients = std::array<double, kMostJacobianCoefficients>;

/// An element of the part of the mesh that is cured.
struct Patient {
  ElementType type;
  std::span<const NodeId> nodes;
  Vec3d reference;
  double scale = 1;  // of its coefficients
  double worst = 1;  // nearness of one of them, over the scale
  bool valid = false;
};

template <class Functor>
void for_each_share(std::size_t count, const Functor& functor) {
  parallel_for((count + kShare - 1) / kShare, [&](std::size_t s) {
    for (std::size_t i = s * kShare; i < std::min(count, (s + 1) * kShare); ++i) functor(i);
  });
}

template <class Real>
class Cure {
 public:
  Cure(CureGoal goal, const TopologyView& topology, std::span<const std::uint8_t> held,
       const SurfaceOrientation& orientation, std::span<Vec3<Real>> positions)
      : goal_(goal),
        plan_(kPlans[static_cast<int>(goal)]),
        topology_(topology),
        held_(held),
        orientation_(orientation),
        positions_(positions) {}

  void run(const std::function<bool()>& goes_on) {
    std::vector<std::uint8_t> chosen = nodes_to_cure();
    for (int ring = 0; ring < plan_.rings; ++ring) add_ring(chosen);
    gather(chosen);
    colour();
    double best = find_worst();
    int idle = 0;
    for (int sweep = 0; sweep < plan_.most_sweeps && best < plan_.wanted; ++sweep) {
      if (idle == plan_.most_idle || !this->sweep(goes_on)) return;
      const double now = find_worst();
      idle = now > best + 1e-3 ? 0 : idle + 1;
      best = std::max(best, now);
    }
  }

 private:
  [[nodiscard]] std::span<const Vec3<Real>> positions() const { return positions_; }
  [[nodiscard]] bool is_valid(const Patient& patient) const {
    return detail::is_valid(patient.type, patient.nodes, positions(), patient.reference);
  }

  /// Finds the scale, the worst coefficient and whether the element is valid.
  void examine(Patient& patient) const {
    const auto nodes = positions_of(patient.nodes, positions());
    patient.valid = is_valid(patient);
    Coefficients found{};
    const std::size_t count =
        jacobian_coefficients(patient.type, nodes.data(), patient.reference, found.data());
    double sum = 0;
    for (std::size_t k = 0; k < count; ++k) sum += std::abs(found[k]);
    patient.scale = sum > 0 ? sum / static_cast<double>(count) : 1;
    patient.worst = worst_of(patient);
  }

  [[nodiscard]] double worst_of(const Patient& patient) const {
    const auto nodes = positions_of(patient.nodes, positions());
    Coefficients found{};
    const std::size_t count =
        jacobian_coefficients(patient.type, nodes.data(), patient.reference, found.data());
    double worst = 1;
    for (std::size_t k = 0; k < count; ++k) {
      worst = std::min(worst, nearness(found[k] / patient.scale));
    }
    return worst;
  }

  [[nodiscard]] bool needs_cure(Patient patient) const {
    if (goal_ == CureGoal::validity) return !is_valid(patient);
    if (is_straight(patient.type, positions_of(patient.nodes, positions()).data())) return false;
    examine(patient);
    return patient.worst < plan_.wanted;
  }

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

  [[nodiscard]] std::vector<std::uint8_t> nodes_to_cure() const {
    std::vector<std::uint8_t> chosen(positions_.size());
    std::size_t first = 0;
    for (const ElementBlockView& block : topology_.blocks) {
      const std::size_t width = element_width(block.type);
      std::vector<std::uint8_t> cured(block.element_count());
      for_each_share(cured.size(), [&](std::size_t e) {
        cured[e] = needs_cure(
            {block.type, block.nodes.subspan(e * width, width), orientation_.reference(first + e)});
      });
      for (std::size_t e = 0; e < cured.size(); ++e) {
        for (std::size_t n = 0; cured[e] != 0 && n < width; ++n) {
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

  /// The nodes that may move, ascending, and all elements at them.
  void gather(const std::vector<std::uint8_t>& chosen) {
    std::vector<std::int32_t> index(positions_.size(), -1);
    for (std::size_t n = 0; n < chosen.size(); ++n) {
      if (chosen[n] == 0 || held_[n] != 0) continue;
      index[n] = static_cast<std::int32_t>(nodes_.size());
      nodes_.push_back(static_cast<NodeId>(n));
    }
    elements_at_.resize(nodes_.size());
    for_each_element([&](ElementType type, std::span<const NodeId> nodes, std::size_t element) {
      bool moves = false;
      for (const NodeId node : nodes) {
        const std::int32_t at = index[static_cast<std::size_t>(node)];
        if (at < 0) continue;
        elements_at_[static_cast<std::size_t>(at)].push_back(patients_.size());
        moves = true;
      }
      if (moves) patients_.push_back({type, nodes, orientation_.reference(element)});
    });
    for_each_share(patients_.size(), [&](std::size_t p) { examine(patients_[p]); });
  }

  /// First fit, in ascending order: nodes of one colour share no element.
  void colour() {
    std::vector<std::uint64_t> used(patients_.size());  // colours at an element, at most 27 nodes
    std::vector<std::size_t> others;
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      std::uint64_t taken = 0;
      for (const std::size_t p : elements_at_[n]) taken |= used[p];
      const std::uint64_t bit = ~taken & (taken + 1);
      if (bit == 0) {
        others.push_back(n);  // each in a colour of its own
        continue;
      }
      for (const std::size_t p : elements_at_[n]) used[p] |= bit;
      const auto colour = static_cast<std::size_t>(std::countr_zero(bit));
      if (colour >= colours_.size()) colours_.resize(colour + 1);
      colours_[colour].push_back(n);
    }
    for (const std::size_t n : others) colours_.push_back({n});
  }

  /// Of all elements.
  double find_worst() {
    for_each_share(patients_.size(),
                   [&](std::size_t p) { patients_[p].worst = worst_of(patients_[p]); });
    double worst = 1;
    for (const Patient& patient : patients_) worst = std::min(worst, patient.worst);
    return worst;
  }

  /// @returns whether the cure goes on
  bool sweep(const std::function<bool()>& goes_on) {
    // Escobar's choice: no smaller than what makes the worst coefficient tell.
    const double low = std::ranges::min_element(patients_, {}, &Patient::worst)->worst;
    delta_ = std::sqrt(0.25 * plan_.wanted * (plan_.wanted - low));
    for (const std::vector<std::size_t>& nodes : colours_) {
      std::vector<std::size_t> poor;
      for (const std::size_t n : nodes) {
        const bool visited = std::ranges::any_of(
            elements_at_[n], [&](std::size_t p) { return patients_[p].worst < plan_.wanted; });
        if (visited) poor.push_back(n);
      }
      for (std::size_t first = 0; first < poor.size(); first += kVisitsPerQuestion) {
        const std::size_t count = std::min(kVisitsPerQuestion, poor.size() - first);
        for_each_share(count, [&](std::size_t i) { visit(poor[first + i]); });
        if (!goes_on()) return false;
      }
    }
    return true;
  }

  /// The coefficients of the elements at a node, and their gradients by its position: exact
  /// differences, for they are linear in it.
  [[nodiscard]] std::vector<LinearCoefficient> linearize(std::size_t index) const {
    std::vector<LinearCoefficient> terms;
    Coefficients at{}, beside{};
    for (const std::size_t p : elements_at_[index]) {
      const Patient& patient = patients_[p];
      auto nodes = positions_of(patient.nodes, positions());
      const auto own = static_cast<std::size_t>(std::ranges::find(patient.nodes, nodes_[index]) -
                                                patient.nodes.begin());
      const double step = norm(nodes[1] - nodes[0]);
      const std::size_t count =
          jacobian_coefficients(patient.type, nodes.data(), patient.reference, at.data());
      const std::size_t first = terms.size();
      for (std::size_t k = 0; k < count; ++k) terms.push_back({at[k] / patient.scale, {0, 0, 0}});
      for (const auto axis : {&Vec3d::x, &Vec3d::y, &Vec3d::z}) {
        const Vec3d there = nodes[own];
        nodes[own].*axis += step;
        jacobian_coefficients(patient.type, nodes.data(), patient.reference, beside.data());
        nodes[own] = there;
        for (std::size_t k = 0; k < count; ++k) {
          terms[first + k].gradient.*axis = (beside[k] - at[k]) / (step * patient.scale);
        }
      }
    }
    return terms;
  }

  void visit(std::size_t index) {
    const std::vector<LinearCoefficient> terms = linearize(index);
    const CoefficientEnergy energy(terms, delta_, plan_.weight);
    const double before = energy.worst({0, 0, 0});
    if (before < plan_.wanted) take(index, energy.minimize(), energy, before);
  }

  /// Moves the node as far as valid elements stay so.
  void take(std::size_t index, Vec3d move, const CoefficientEnergy& energy, double worst) {
    Vec3<Real>& position = positions_[static_cast<std::size_t>(nodes_[index])];
    const Vec3<Real> before = position;
    const auto& elements = elements_at_[index];
    for (int k = 0; k < 6; ++k, move = 0.5 * move) {
      if (goal_ == CureGoal::shape && !(energy.worst(move) > worst)) continue;
      position = vec3_cast<Real>(vec3_cast<double>(before) + move);
      const bool spoils = std::ranges::any_of(
          elements, [&](std::size_t p) { return patients_[p].valid && !is_valid(patients_[p]); });
      if (spoils) continue;
      for (const std::size_t p : elements) patients_[p].valid |= is_valid(patients_[p]);
      return;
    }
    position = before;
  }

  CureGoal goal_;
  Plan plan_;
  const TopologyView& topology_;
  std::span<const std::uint8_t> held_;
  const SurfaceOrientation& orientation_;
  std::span<Vec3<Real>> positions_;
  std::vector<Patient> patients_;
  std::vector<NodeId> nodes_;
  std::vector<std::vector<std::size_t>> elements_at_;  // patients, by index in `nodes_`
  std::vector<std::vector<std::size_t>> colours_;      // indices in `nodes_`
  double delta_ = 0;
};

}  // namespace

template <class Real>
void cure(CureGoal goal, const TopologyView& topology, std::span<const std::uint8_t> held,
          const SurfaceOrientation& orientation, std::span<Vec3<Real>> positions,
          const std::function<bool()>& goes_on) {
  Cure<Real>(goal, topology, held, orientation, positions).run(goes_on);
}

template void cure(CureGoal, const TopologyView&, std::span<const std::uint8_t>,
                   const SurfaceOrientation&, std::span<Vec3f>, const std::function<bool()>&);
template void cure(CureGoal, const TopologyView&, std::span<const std::uint8_t>,
                   const SurfaceOrientation&, std::span<Vec3d>, const std::function<bool()>&);

}  // namespace meshsmooth::detail
