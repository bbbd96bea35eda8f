#include "smooth/second_order/repair_curved.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <vector>

#include "mesh/curved_jacobian.hpp"
#include "smooth/second_order/coefficient_energy.hpp"
#include "smooth/second_order/repaired_part.hpp"
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

/// How many visits to make before it is asked whether the repair goes on: among tetrahedra one
/// takes 15 us, among hexahedra up to 2 ms.
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
class CurvedRepair {
 public:
  CurvedRepair(RepairGoal goal, const TopologyView& topology, const RepairScope<Real>& scope,
               const SurfaceOrientation& orientation, std::span<Vec3<Real>> positions)
      : goal_(goal),
        plan_(kPlans[static_cast<int>(goal)]),
        topology_(topology),
        scope_(scope),
        orientation_(orientation),
        positions_(positions) {}

  /// @returns the bytes that it holds
  std::int64_t run(const std::function<bool()>& goes_on) {
    part_.emplace(topology_, orientation_, nodes_to_repair(),
                  goal_ == RepairGoal::validity ? scope_.rings : 0, scope_.held);
    for_each_share(part_elements().size(), kElementShare,
                   [&](std::size_t p) { examine(part_elements()[p]); });
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
  [[nodiscard]] std::vector<PartElement>& part_elements() { return part_->part_elements(); }
  [[nodiscard]] const std::vector<PartElement>& part_elements() const {
    return part_->part_elements();
  }
  [[nodiscard]] bool is_valid(const PartElement& element) const {
    const auto nodes = positions_of(element.nodes, positions());
    return detail::is_valid(element.type, nodes.data(), element.reference);
  }

  /// Finds the scale, the worst coefficient and whether the element is valid.
  void examine(PartElement& element) const {
    element.valid = is_valid(element);
    Coefficients found;
    const auto all = coefficients_of(element, found);
    double sum = 0;
    for (const double c : all) sum += std::abs(c);
    element.scale = sum > 0 ? sum / static_cast<double>(all.size()) : 1;
    element.worst = worst_of(element);
  }

  std::span<const double> coefficients_of(const PartElement& element, Coefficients& found) const {
    const auto nodes = positions_of(element.nodes, positions());
    return std::span(found).first(
        jacobian_coefficients(element.type, nodes.data(), element.reference, found.data()));
  }

  [[nodiscard]] double worst_of(const PartElement& element) const {
    Coefficients found;
    double worst = 1;
    for (const double c : coefficients_of(element, found)) {
      worst = std::min(worst, nearness(c / element.scale));
    }
    return worst;
  }

  [[nodiscard]] bool needs_repair(PartElement element) const {
    if (goal_ == RepairGoal::validity) return !is_valid(element);
    if (is_straight(element.type, positions_of(element.nodes, positions()).data())) return false;
    examine(element);
    return element.worst < plan_.wanted;
  }

  [[nodiscard]] std::vector<std::uint8_t> nodes_to_repair() const {
    std::vector<std::uint8_t> chosen(positions_.size());
    for_each_element(topology_,
                     [&](ElementType type, std::span<const NodeId> nodes, std::size_t element) {
                       if (needs_repair({type, nodes, orientation_.reference(element)}))
                         mark_nodes(nodes, chosen);
                     });
    return chosen;
  }

  /// Of all elements.
  double find_worst() {
    for_each_share(part_elements().size(), kElementShare,
                   [&](std::size_t p) { part_elements()[p].worst = worst_of(part_elements()[p]); });
    double worst = 1;
    for (const PartElement& element : part_elements()) worst = std::min(worst, element.worst);
    return worst;
  }

  /// @returns whether the repair goes on
  bool sweep(const std::function<bool()>& goes_on) {
    // Escobar's choice: no smaller than what makes the worst coefficient tell.
    const double low = std::ranges::min_element(part_elements(), {}, &PartElement::worst)->worst;
    delta_ = std::sqrt(0.25 * plan_.wanted * (plan_.wanted - low));
    for (const std::vector<std::size_t>& nodes : part_->colours()) {
      std::vector<std::size_t> poor;
      for (const std::size_t n : nodes) {
        const bool visited = std::ranges::any_of(part_->elements_at(n), [&](std::size_t p) {
          return part_elements()[p].worst < plan_.wanted;
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
      const PartElement& element = part_elements()[p];
      const auto nodes = positions_of(element.nodes, positions());
      const auto own =
          std::ranges::find(element.nodes, part_->nodes()[index]) - element.nodes.begin();
      const std::size_t count =
          jacobian_coefficients_at(static_cast<std::size_t>(own), element.type, nodes.data(),
                                   element.reference, values.data(), gradients.data());
      const double share = 1 / element.scale;
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
      if (goal_ != RepairGoal::validity &&
          !(worst_after(terms, vec3_cast<double>(to) - from) > worst)) {
        continue;
      }
      position = to;
      const bool spoils = std::ranges::any_of(elements, [&](std::size_t p) {
        return part_elements()[p].valid && !is_valid(part_elements()[p]);
      });
      if (spoils) continue;
      for (const std::size_t p : elements) part_elements()[p].valid |= is_valid(part_elements()[p]);
      return;
    }
    position = before;
  }

  RepairGoal goal_;
  Plan plan_;
  const TopologyView& topology_;
  const RepairScope<Real>& scope_;
  const SurfaceOrientation& orientation_;
  std::span<Vec3<Real>> positions_;
  std::optional<RepairedPart> part_;
  double delta_ = 0;
  Batch batch_;
};

}  // namespace

template <class Real>
std::int64_t repair_curved(RepairGoal goal, const TopologyView& topology,
                           const RepairScope<Real>& scope, const SurfaceOrientation& orientation,
                           std::span<Vec3<Real>> positions, const std::function<bool()>& goes_on) {
  return CurvedRepair<Real>(goal, topology, scope, orientation, positions).run(goes_on);
}

template std::int64_t repair_curved(RepairGoal, const TopologyView&, const RepairScope<float>&,
                                    const SurfaceOrientation&, std::span<Vec3f>,
                                    const std::function<bool()>&);
template std::int64_t repair_curved(RepairGoal, const TopologyView&, const RepairScope<double>&,
                                    const SurfaceOrientation&, std::span<Vec3d>,
                                    const std::function<bool()>&);

std::int64_t repair_bytes(const MeshSize& size) {
  RepairedPart::Size whole{.nodes = size.node_count};
  for (const ElementType type : kElementTypes) {
    const std::int64_t count = size.element_counts[static_cast<std::size_t>(type)];
    if (count == 0 || !is_second_order(type)) continue;
    whole.elements += count;
    whole.add(type, count);
  }
  return whole.elements == 0 ? 0 : whole.bytes();
}

}  // namespace meshsmooth::detail
