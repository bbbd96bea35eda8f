#include "smooth/second_order/cure.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <vector>

#include "mesh/curved_jacobian.hpp"
#include "smooth/second_order/coefficient_energy.hpp"
#include "smooth/second_order/cured_part.hpp"
#include "smooth/second_order/shares.hpp"

namespace meshsmooth::detail {
namespace {

/// By goal.
struct Plan {
  double wanted;  // of the worst coefficient's nearness to the mean: elements below it are visited
  int most_sweeps;
  int most_idle;   // sweeps that do not raise the worst
  double barrier;  // as a share of the worst coefficient at a node
};
constexpr Plan kPlans[] = {{0.15, 60, 6, 0}, {0.85, 20, 3, 0.9}, {0.65, 20, 3, 0.9}};

constexpr std::size_t kShare = 4;  // visits that a thread takes at a time

using Coefficients = std::array<double, kMostJacobianCoefficients>;

/// How many visits to make before it is asked whether the cure goes on: among tetrahedra one takes
/// 15 us, among hexahedra up to 2 ms.
class Batch {
 public:
  [[nodiscard]] std::size_t size() const { return size_; }

  template <class Work>
  void time(const Work& work) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    work();
    const std::chrono::duration<double, std::milli> taken = Clock::now() - start;
    if (taken.count() < 2) size_ = std::min<std::size_t>(size_ * 2, 1 << 16);
    if (taken.count() > 8) size_ = std::max<std::size_t>(size_ / 2, 16);
  }

 private:
  std::size_t size_ = 64;
};

template <class Real>
class Cure {
 public:
  Cure(CureGoal goal, const TopologyView& topology, const CureScope<Real>& scope,
       const SurfaceOrientation& orientation, std::span<Vec3<Real>> positions)
      : goal_(goal),
        plan_(kPlans[static_cast<int>(goal)]),
        topology_(topology),
        scope_(scope),
        orientation_(orientation),
        positions_(positions) {}

  /// @returns the bytes that it holds
  std::int64_t run(const std::function<bool()>& goes_on) {
    part_.emplace(topology_, orientation_, nodes_to_cure(),
                  goal_ == CureGoal::validity ? scope_.rings : 0, scope_.held);
    for_each_share(patients().size(), kElementShare,
                   [&](std::size_t p) { examine(patients()[p]); });
    double best = find_worst();
    int idle = 0;
    for (int sweep = 0; sweep < plan_.most_sweeps && best < plan_.wanted; ++sweep) {
      if (idle == plan_.most_idle || !this->sweep(goes_on)) break;
      const double now = find_worst();
      idle = now > best + 1e-3 ? 0 : idle + 1;
      best = std::max(best, now);
    }
    return part_->bytes();
  }

 private:
  [[nodiscard]] std::span<const Vec3<Real>> positions() const { return positions_; }
  [[nodiscard]] std::vector<Patient>& patients() { return part_->patients(); }
  [[nodiscard]] const std::vector<Patient>& patients() const { return part_->patients(); }
  [[nodiscard]] bool is_valid(const Patient& patient) const {
    const auto nodes = positions_of(patient.nodes, positions());
    return detail::is_valid(patient.type, nodes.data(), patient.reference);
  }

  /// Finds the scale, the worst coefficient and whether the element is valid.
  void examine(Patient& patient) const {
    patient.valid = is_valid(patient);
    Coefficients found;
    const auto all = coefficients_of(patient, found);
    double sum = 0;
    for (const double c : all) sum += std::abs(c);
    patient.scale = sum > 0 ? sum / static_cast<double>(all.size()) : 1;
    patient.worst = worst_of(patient);
  }

  std::span<const double> coefficients_of(const Patient& patient, Coefficients& found) const {
    const auto nodes = positions_of(patient.nodes, positions());
    return std::span(found).first(
        jacobian_coefficients(patient.type, nodes.data(), patient.reference, found.data()));
  }

  [[nodiscard]] double worst_of(const Patient& patient) const {
    Coefficients found;
    double worst = 1;
    for (const double c : coefficients_of(patient, found)) {
      worst = std::min(worst, nearness(c / patient.scale));
    }
    return worst;
  }

  [[nodiscard]] bool needs_cure(Patient patient) const {
    if (goal_ == CureGoal::validity) return !is_valid(patient);
    if (is_straight(patient.type, positions_of(patient.nodes, positions()).data())) return false;
    examine(patient);
    return patient.worst < plan_.wanted;
  }

  [[nodiscard]] std::vector<std::uint8_t> nodes_to_cure() const {
    std::vector<std::uint8_t> chosen(positions_.size());
    for_each_element(topology_,
                     [&](ElementType type, std::span<const NodeId> nodes, std::size_t element) {
                       if (needs_cure({type, nodes, orientation_.reference(element)}))
                         mark_nodes(nodes, chosen);
                     });
    return chosen;
  }

  /// Of all elements.
  double find_worst() {
    for_each_share(patients().size(), kElementShare,
                   [&](std::size_t p) { patients()[p].worst = worst_of(patients()[p]); });
    double worst = 1;
    for (const Patient& patient : patients()) worst = std::min(worst, patient.worst);
    return worst;
  }

  /// @returns whether the cure goes on
  bool sweep(const std::function<bool()>& goes_on) {
    // Escobar's choice: no smaller than what makes the worst coefficient tell.
    const double low = std::ranges::min_element(patients(), {}, &Patient::worst)->worst;
    delta_ = std::sqrt(0.25 * plan_.wanted * (plan_.wanted - low));
    for (const std::vector<std::size_t>& nodes : part_->colours()) {
      std::vector<std::size_t> poor;
      for (const std::size_t n : nodes) {
        const bool visited = std::ranges::any_of(part_->elements_at(n), [&](std::size_t p) {
          return patients()[p].worst < plan_.wanted;
        });
        if (visited) poor.push_back(n);
      }
      for (std::size_t first = 0; first < poor.size();) {
        const std::size_t count = std::min(batch_.size(), poor.size() - first);
        batch_.time(
            [&] { for_each_share(count, kShare, [&](std::size_t i) { visit(poor[first + i]); }); });
        first += count;
        if (!goes_on()) return false;
      }
    }
    return true;
  }

  /// The coefficients of the elements at a node.
  [[nodiscard]] std::vector<LinearCoefficient> linearize(std::size_t index) const {
    std::vector<LinearCoefficient> terms;
    terms.reserve(part_->elements_at(index).size() * 20);  // as many as a tetrahedron has
    Coefficients values;
    std::array<Vec3d, kMostJacobianCoefficients> gradients;
    for (const std::size_t p : part_->elements_at(index)) {
      const Patient& patient = patients()[p];
      const auto nodes = positions_of(patient.nodes, positions());
      const auto own =
          std::ranges::find(patient.nodes, part_->nodes()[index]) - patient.nodes.begin();
      const std::size_t count =
          jacobian_coefficients_at(static_cast<std::size_t>(own), patient.type, nodes.data(),
                                   patient.reference, values.data(), gradients.data());
      const double share = 1 / patient.scale;
      for (std::size_t k = 0; k < count; ++k) {
        terms.push_back({share * values[k], share * gradients[k]});
      }
    }
    return terms;
  }

  void visit(std::size_t index) {
    const std::vector<LinearCoefficient> terms = linearize(index);
    const double before = worst_after(terms, {0, 0, 0});
    if (!(before < plan_.wanted)) return;
    const double barrier = plan_.barrier * std::max(before, 0.0);
    const CoefficientEnergy energy(terms, barrier, barrier > 0 ? 0 : delta_);
    take(index, energy.minimize(), terms, before);
  }

  /// Moves the node as far as valid elements stay so.
  void take(std::size_t index, Vec3d move, std::span<const LinearCoefficient> terms, double worst) {
    const auto node = static_cast<std::size_t>(part_->nodes()[index]);
    Vec3<Real>& position = positions_[node];
    const Vec3<Real> before = position;
    const auto from = vec3_cast<double>(before);
    const auto elements = part_->elements_at(index);
    for (int k = 0; k < 6; ++k, move = 0.5 * move) {
      const Vec3<Real> to = scope_.limit.clamp(node, vec3_cast<Real>(from + move));
      if (goal_ != CureGoal::validity &&
          !(worst_after(terms, vec3_cast<double>(to) - from) > worst)) {
        continue;
      }
      position = to;
      const bool spoils = std::ranges::any_of(
          elements, [&](std::size_t p) { return patients()[p].valid && !is_valid(patients()[p]); });
      if (spoils) continue;
      for (const std::size_t p : elements) patients()[p].valid |= is_valid(patients()[p]);
      return;
    }
    position = before;
  }

  CureGoal goal_;
  Plan plan_;
  const TopologyView& topology_;
  const CureScope<Real>& scope_;
  const SurfaceOrientation& orientation_;
  std::span<Vec3<Real>> positions_;
  std::optional<CuredPart> part_;
  double delta_ = 0;
  Batch batch_;
};

}  // namespace

template <class Real>
std::int64_t cure(CureGoal goal, const TopologyView& topology, const CureScope<Real>& scope,
                  const SurfaceOrientation& orientation, std::span<Vec3<Real>> positions,
                  const std::function<bool()>& goes_on) {
  return Cure<Real>(goal, topology, scope, orientation, positions).run(goes_on);
}

template std::int64_t cure(CureGoal, const TopologyView&, const CureScope<float>&,
                           const SurfaceOrientation&, std::span<Vec3f>,
                           const std::function<bool()>&);
template std::int64_t cure(CureGoal, const TopologyView&, const CureScope<double>&,
                           const SurfaceOrientation&, std::span<Vec3d>,
                           const std::function<bool()>&);

std::int64_t cure_bytes(const MeshSize& size) {
  CuredPart::Size whole{.nodes = size.node_count};
  for (const ElementType type : kElementTypes) {
    const std::int64_t count = size.element_counts[static_cast<std::size_t>(type)];
    if (count == 0 || !is_second_order(type)) continue;
    whole.elements += count;
    whole.add(type, count);
  }
  return whole.elements == 0 ? 0 : whole.bytes();
}

}  // namespace meshsmooth::detail
