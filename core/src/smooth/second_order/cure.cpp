#include "smooth/second_order/cure.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <vector>

#include "mesh/boundary_nodes.hpp"
#include "mesh/curved_jacobian.hpp"
#include "smooth/second_order/coefficient_energy.hpp"
#include "smooth/second_order/shares.hpp"

namespace meshsmooth::detail {
namespace {

/// By goal.
struct Plan {
  double wanted;  // of the worst coefficient's nearness to the mean: elements below it are visited
  int most_sweeps;
  int most_idle;  // sweeps that do not raise the worst
  double weight;  // of the distance from the mean
};
constexpr Plan kPlans[] = {{0.15, 60, 6, 0}, {0.85, 20, 3, 1}, {0.65, 20, 3, 1}};

constexpr std::size_t kShare = 4;  // visits that a thread takes at a time

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

/// What the bytes of a cure follow from.
struct CureSize {
  std::int64_t nodes = 0, elements = 0;                // of the mesh
  std::int64_t patients = 0, entries = 0, facets = 0;  // of the part that is cured; entries: nodes

  void add(ElementType type, std::int64_t count) {
    patients += count;
    entries += count * static_cast<std::int64_t>(element_width(type));
    facets += count * element_shape(type).facet_count;
  }

  /// The boundary is found first, then the part is kept; lists that grow have up to twice their
  /// size.
  [[nodiscard]] std::int64_t bytes() const {
    const std::int64_t boundary = boundary_nodes_bytes(nodes, facets) + 4 * entries + 4 * patients;
    const std::int64_t part = nodes * (4 + 4 + 8 + 2 * 8 + 2 * 8) + elements + 8 * entries +
                              patients * (static_cast<std::int64_t>(sizeof(Patient)) + 8);
    return 3 * nodes + elements + std::max(boundary, part);
  }
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
        positions_(positions) {
    size_.nodes = static_cast<std::int64_t>(topology.node_count);
    size_.elements = static_cast<std::int64_t>(topology.element_count());
  }

  /// @returns the bytes that it holds
  std::int64_t run(const std::function<bool()>& goes_on) {
    std::vector<std::uint8_t> chosen = nodes_to_cure();
    const int rings = goal_ == CureGoal::validity ? scope_.rings : 0;
    for (int ring = 0; ring < rings; ++ring) add_ring(chosen);
    gather(chosen);
    colour();
    double best = find_worst();
    int idle = 0;
    for (int sweep = 0; sweep < plan_.most_sweeps && best < plan_.wanted; ++sweep) {
      if (idle == plan_.most_idle || !this->sweep(goes_on)) break;
      const double now = find_worst();
      idle = now > best + 1e-3 ? 0 : idle + 1;
      best = std::max(best, now);
    }
    return size_.bytes();
  }

 private:
  [[nodiscard]] std::span<const Vec3<Real>> positions() const { return positions_; }
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

  /// Calls `visit(type, nodes, element)` for all elements, on all threads.
  template <class Visit>
  void for_each_element(const Visit& visit) const {
    std::size_t first = 0;
    for (const ElementBlockView& block : topology_.blocks) {
      const std::size_t width = element_width(block.type);
      for_each_share(block.element_count(), kElementShare, [&](std::size_t e) {
        visit(block.type, block.nodes.subspan(e * width, width), first + e);
      });
      first += block.element_count();
    }
  }

  /// Marks the nodes of elements.
  static void mark(std::span<const NodeId> nodes, std::vector<std::uint8_t>& marks) {
    for (const NodeId node : nodes) {
      std::atomic_ref(marks[static_cast<std::size_t>(node)]).store(1, std::memory_order_relaxed);
    }
  }

  [[nodiscard]] std::vector<std::uint8_t> nodes_to_cure() const {
    std::vector<std::uint8_t> chosen(positions_.size());
    for_each_element([&](ElementType type, std::span<const NodeId> nodes, std::size_t element) {
      if (needs_cure({type, nodes, orientation_.reference(element)})) mark(nodes, chosen);
    });
    return chosen;
  }

  void add_ring(std::vector<std::uint8_t>& chosen) const {
    const std::vector<std::uint8_t> inner = chosen;
    for_each_element([&](ElementType, std::span<const NodeId> nodes, std::size_t) {
      const bool touches = std::ranges::any_of(
          nodes, [&](NodeId node) { return inner[static_cast<std::size_t>(node)] != 0; });
      if (touches) mark(nodes, chosen);
    });
  }

  /// The nodes that may move, ascending, and all elements at them.
  void gather(std::vector<std::uint8_t>& chosen) {
    const std::vector<std::uint8_t> touched = elements_touching(chosen);
    for (std::size_t n = 0; n < chosen.size(); ++n) {
      if (scope_.held[n] != 0) chosen[n] = 0;
    }
    for (const NodeId node : boundary_of(touched)) chosen[static_cast<std::size_t>(node)] = 0;

    std::vector<std::int32_t> index(positions_.size(), -1);
    nodes_.reserve(static_cast<std::size_t>(std::ranges::count(chosen, 1)));
    for (std::size_t n = 0; n < chosen.size(); ++n) {
      if (chosen[n] == 0) continue;
      index[n] = static_cast<std::int32_t>(nodes_.size());
      nodes_.push_back(static_cast<NodeId>(n));
    }
    const std::vector<std::uint8_t> moves = elements_touching(chosen);
    patients_.reserve(static_cast<std::size_t>(std::ranges::count(moves, 1)));
    std::size_t element = 0;
    for (const ElementBlockView& block : topology_.blocks) {
      const std::size_t width = element_width(block.type);
      for (std::size_t at = 0; at < block.nodes.size(); at += width, ++element) {
        if (moves[element] == 0) continue;
        patients_.push_back(
            {block.type, block.nodes.subspan(at, width), orientation_.reference(element)});
      }
    }
    list_elements([&](NodeId node) { return index[static_cast<std::size_t>(node)]; });
    for_each_share(patients_.size(), kElementShare, [&](std::size_t p) { examine(patients_[p]); });
  }

  [[nodiscard]] std::vector<std::uint8_t> elements_touching(
      const std::vector<std::uint8_t>& chosen) const {
    std::vector<std::uint8_t> touching(topology_.element_count());
    for_each_element([&](ElementType, std::span<const NodeId> nodes, std::size_t element) {
      touching[element] = std::ranges::any_of(
          nodes, [&](NodeId node) { return chosen[static_cast<std::size_t>(node)] != 0; });
    });
    return touching;
  }

  /// Of some elements: a facet that others share too has no node that they do not all touch.
  [[nodiscard]] std::vector<NodeId> boundary_of(const std::vector<std::uint8_t>& elements) {
    std::vector<ElementBlock> blocks;
    std::vector<std::int32_t> regions;
    std::size_t element = 0;
    for (const ElementBlockView& block : topology_.blocks) {
      const std::size_t width = element_width(block.type);
      std::vector<NodeId>& nodes = blocks.emplace_back(ElementBlock{block.type, {}}).nodes;
      const auto count =
          std::ranges::count(std::span(elements).subspan(element, block.element_count()), 1);
      nodes.reserve(static_cast<std::size_t>(count) * width);
      size_.add(block.type, count);
      for (std::size_t at = 0; at < block.nodes.size(); at += width, ++element) {
        if (elements[element] == 0) continue;
        const std::span own = block.nodes.subspan(at, width);
        nodes.insert(nodes.end(), own.begin(), own.end());
        if (!topology_.regions.empty()) regions.push_back(topology_.regions[element]);
      }
    }
    std::vector<ElementBlockView> views;
    for (const ElementBlock& block : blocks) views.push_back({block.type, block.nodes});
    return find_boundary_nodes({topology_.node_count, views, {}, regions}, true);
  }

  template <class IndexOf>
  void list_elements(const IndexOf& index_of) {
    const auto visit_entries = [&](const auto& visit) {
      for (std::size_t p = 0; p < patients_.size(); ++p) {
        for (const NodeId node : patients_[p].nodes) {
          if (index_of(node) >= 0) visit(static_cast<std::size_t>(index_of(node)), p);
        }
      }
    };
    first_element_.assign(nodes_.size() + 2, 0);
    visit_entries([&](std::size_t n, std::size_t) { ++first_element_[n + 2]; });
    for (std::size_t n = 2; n < first_element_.size(); ++n) {
      first_element_[n] += first_element_[n - 1];
    }
    elements_.resize(first_element_.back());
    visit_entries([&](std::size_t n, std::size_t p) { elements_[first_element_[n + 1]++] = p; });
  }

  /// The patients at a node, by its index.
  [[nodiscard]] std::span<const std::size_t> elements_at(std::size_t n) const {
    return std::span(elements_).subspan(first_element_[n],
                                        first_element_[n + 1] - first_element_[n]);
  }

  /// First fit, in ascending order: nodes of one colour share no element.
  void colour() {
    std::vector<std::uint64_t> used(patients_.size());  // colours at an element, at most 27 nodes
    std::vector<std::size_t> others;
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      std::uint64_t taken = 0;
      for (const std::size_t p : elements_at(n)) taken |= used[p];
      const std::uint64_t bit = ~taken & (taken + 1);
      if (bit == 0) {
        others.push_back(n);  // each in a colour of its own
        continue;
      }
      for (const std::size_t p : elements_at(n)) used[p] |= bit;
      const auto colour = static_cast<std::size_t>(std::countr_zero(bit));
      if (colour >= colours_.size()) colours_.resize(colour + 1);
      colours_[colour].push_back(n);
    }
    for (const std::size_t n : others) colours_.push_back({n});
  }

  /// Of all elements.
  double find_worst() {
    for_each_share(patients_.size(), kElementShare,
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
            elements_at(n), [&](std::size_t p) { return patients_[p].worst < plan_.wanted; });
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
    terms.reserve(elements_at(index).size() * 20);  // as many as a tetrahedron has
    Coefficients values;
    std::array<Vec3d, kMostJacobianCoefficients> gradients;
    for (const std::size_t p : elements_at(index)) {
      const Patient& patient = patients_[p];
      const auto nodes = positions_of(patient.nodes, positions());
      const auto own = std::ranges::find(patient.nodes, nodes_[index]) - patient.nodes.begin();
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
    const CoefficientEnergy energy(terms, delta_, plan_.weight);
    const double before = energy.worst({0, 0, 0});
    if (before < plan_.wanted) take(index, energy.minimize(), energy, before);
  }

  /// Moves the node as far as valid elements stay so.
  void take(std::size_t index, Vec3d move, const CoefficientEnergy& energy, double worst) {
    const auto node = static_cast<std::size_t>(nodes_[index]);
    Vec3<Real>& position = positions_[node];
    const Vec3<Real> before = position;
    const auto from = vec3_cast<double>(before);
    const auto elements = elements_at(index);
    for (int k = 0; k < 6; ++k, move = 0.5 * move) {
      const Vec3<Real> to = scope_.limit.clamp(node, vec3_cast<Real>(from + move));
      if (goal_ != CureGoal::validity && !(energy.worst(vec3_cast<double>(to) - from) > worst)) {
        continue;
      }
      position = to;
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
  const CureScope<Real>& scope_;
  const SurfaceOrientation& orientation_;
  std::span<Vec3<Real>> positions_;
  CureSize size_;
  std::vector<Patient> patients_;
  std::vector<NodeId> nodes_;
  std::vector<std::size_t> first_element_, elements_;  // rows of patients, by index in `nodes_`
  std::vector<std::vector<std::size_t>> colours_;      // indices in `nodes_`
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
  CureSize whole{.nodes = size.node_count};
  for (const ElementType type : kElementTypes) {
    const std::int64_t count = size.element_counts[static_cast<std::size_t>(type)];
    if (count == 0 || !is_second_order(type)) continue;
    whole.elements += count;
    whole.add(type, count);
  }
  return whole.elements == 0 ? 0 : whole.bytes();
}

}  // namespace meshsmooth::detail
