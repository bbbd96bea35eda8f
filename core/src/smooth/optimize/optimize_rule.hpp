#pragma once

#include "mesh/jacobian.hpp"
#include "smooth/base/displacement.hpp"
#include "smooth/energy/newton_step.hpp"

namespace meshsmooth::detail {

/// Below this Newton decrement a ball has converged.
inline constexpr double kRestDecrement = 4e-6;

/// What the visits of a phase do.
struct OptimizePhase {
  int power = 2;       // of the energy of valid balls, a power of two
  double poor = 0;     // visit only balls whose worst inverse mean ratio is above
  bool guard = true;   // in a tangled ball valid corners stay valid
  bool facets = true;  // those of sliding nodes that are right stay right
  /// Above 0 valid balls descend a regularized energy too: e is at least this share of the
  /// volume of an ideal corner of the ball's size.
  double softness = 0;
  double rest = kRestDecrement;  // nodes of balls with a smaller one stay
};

/// What one visit did.
template <class Real>
struct Visit {
  Vec3<Real> position;
  double gain = 0;       // relative fall of the ball's energy to the power of 1/p; 0 in repair
  double depth = 0;      // of the deepest inversion of a tangled ball: its -D
  bool tangled = false;  // a corner is not certainly positive
  bool held = false;     // no trial of its move was better
};

/// The least relative gain of an accepted move: more than rounding.
inline constexpr double kLeastFall = 1e-12;
/// Above this Newton decrement, multiples of the step are tried too.
inline constexpr double kStretchDecrement = 0.1;
/// Over-relaxation: neighbours move too.
inline constexpr double kOverRelaxation = 1.4;

/// The best position along a direction.
template <class Real>
struct Found {
  Vec3<Real> position;
  double value;
};

/// Line search: tries 1, 1/2, … 1/32 of `step` from `before`; after a whole step 2 and 4 times it,
/// if `stretch`. `project(position)` gives the position as it will be stored, at which
/// `evaluate` gives the value to minimize; `value` is that at `before`.
template <class Real, class Project, class Evaluate>
MESHSMOOTH_HD Found<Real> search_along(Vec3<Real> before, Vec3d step, bool stretch, double value,
                                       const Project& project, const Evaluate& evaluate) {
  Found<Real> best{before, value};
  const Vec3d origin = vec3_cast<double>(before);
  const auto improves = [&](double length) {
    const Vec3<Real> position = project(vec3_cast<Real>(origin + length * step));
    if (position == best.position) return false;
    const double found = evaluate(position);
    if (!(found < best.value - kLeastFall * std::abs(best.value))) return false;
    best = {position, found};
    return true;
  };
  double factor = 0;  // from trial to trial
  for (double length = 1; length > 0.03; length *= factor) {
    const bool better = improves(length);
    if (factor == 0) factor = better ? 2 : 0.5;
    if (factor > 1 ? !(better && stretch && length < 4) : better) break;
  }
  return best;
}

/// The normal of the plane in which a surface node moves: that of the plane mesh, else the mean of
/// its ball's references; zero if there is none.
template <class Team>
MESHSMOOTH_HD Vec3d node_normal(const Team& team, const Surroundings& around, std::size_t node) {
  if (around.references == nullptr) return around.reference;
  Vec3d sum{0, 0, 0};
  const ElementId* const end = around.balls.end(node);
  for (const ElementId* e = around.balls.begin(node) + team.rank; e < end; e += team.size) {
    sum += around.reference_of(*e);
  }
  sum = {team.sum(sum.x), team.sum(sum.y), team.sum(sum.z)};
  const double length = norm(sum);
  return length > 1e-6 ? (1 / length) * sum : Vec3d{0, 0, 0};
}

/// Whether every volume element at a node whose Jacobian is certainly positive everywhere keeps it
/// so with the node moved. The corners themselves are not checked.
template <class Team, class P>
MESHSMOOTH_HD bool keeps_jacobians(const Team& team, const Surroundings& around, const P& x,
                                   std::size_t node, Vec3<typename P::Real> position) {
  if (around.elements.simplices()) return true;
  bool keeps = true;
  const ElementId* const end = around.balls.end(node);
  for (const ElementId* e = around.balls.begin(node) + team.rank; keeps && e < end;
       e += team.size) {
    const ElementView element = around.elements[*e];
    const auto lies = [&](int n) {
      return vec3_cast<double>(x[static_cast<std::size_t>(element.nodes[n])]);
    };
    const auto would_lie = [&](int n) {
      return static_cast<std::size_t>(element.nodes[n]) == node ? vec3_cast<double>(position)
                                                                : lies(n);
    };
    keeps = jacobian_sign(*element.shape, would_lie) == JacobianSign::positive ||
            jacobian_sign(*element.shape, lies) != JacobianSign::positive;
  }
  return team.all(keeps);
}

/// One visit of one node. Reads positions, writes none. Without `kBound` the node has neither a
/// displacement limit, nor a constraint, nor an anchor.
template <int kDimension, bool kBound, class Team, class Terms>
class NodeOptimizer {
 public:
  using Real = typename Terms::Real;

  MESHSMOOTH_HD NodeOptimizer(const Team& team, const Surroundings& around, Terms& terms,
                              std::size_t node, Vec3d normal, const OptimizePhase& phase,
                              const DisplacementLimit<Real>& displacement_limit)
      : team_(team),
        around_(around),
        terms_(terms),
        node_(node),
        constraint_(kBound ? around.sliding.constraint(node) : nullptr),
        anchor_(kBound && around.anchors != nullptr ? around.anchors + node : nullptr),
        normal_(normal),
        phase_(phase),
        displacement_limit_(displacement_limit) {}

  /// In a valid ball, or a softened one, one descent step of its energy. In a tangled ball two of
  /// the regularized energy; once it is valid, the second as in a valid ball. One loop for all of
  /// them, so that device code has each pass over a ball only once.
  MESHSMOOTH_HD Visit<Real> visit() {
    Visit<Real> visit{.position = terms_.position()};
    BallEnergy energy{.power = phase_.power};
    if (phase_.poor > 0) {
      const double worst = worst_inverse_ratio<kDimension>(team_, terms_, {0, 0, 0});
      if (worst <= phase_.poor) return visit;
      if (worst < HUGE_VAL) energy.unit = worst;
    }
    const bool soft = phase_.softness > 0;
    bool repairing = soft;
    bool changed = soft;  // the ball must be scanned
    for (int steps = 0;;) {
      if (changed) {
        const BallScan scan = scan_ball<kDimension>(team_, terms_, soft);
        visit.tangled = !scan.valid;
        visit.depth = scan.valid ? 0 : -scan.lowest_volume;
        if (steps == 2 || (soft && steps > 0)) return visit;
        energy = scan.valid && !soft ? BallEnergy{} : regularize(scan);
        changed = false;
      }
      BallDerivatives at = differentiate<kDimension>(team_, terms_, energy);
      if (!repairing && !at.valid()) {
        repairing = changed = visit.held = true;
        continue;
      }
      if (anchored(energy)) {
        add_anchor(*anchor_, vec3_cast<double>(terms_.position()), energy.power, at);
      }
      const NewtonStep newton_step = newton(at);
      if (!(newton_step.decrement >= phase_.rest)) return visit;
      const Found<Real> found = search(energy, at.energy, newton_step);
      const bool stays = found.position == terms_.position();
      if (!repairing || soft) {
        visit.gain = (at.energy - found.value) / (at.energy * energy.power);
        visit.held = stays;
      }
      if (stays) return visit;
      visit.position = found.position;
      if (!repairing || (steps == 1 && !visit.tangled)) return visit;
      visit.held = false;
      terms_.move_to(found.position);
      changed = true;
      ++steps;
    }
  }

 private:
  [[nodiscard]] MESHSMOOTH_HD NewtonStep newton(const BallDerivatives& at) const {
    if (constraint_ != nullptr) {
      const Vec3d direction = constraint_->curved()
                                  ? direction_on_facets(around_.sliding, node_, terms_.positions())
                                  : constraint_->direction;
      return constraint_->along() ? newton_step_on_line(at, direction)
                                  : newton_step_in_plane(at, direction);
    }
    return kDimension == 3 ? newton_step(at) : newton_step_in_plane(at, normal_);
  }

  [[nodiscard]] MESHSMOOTH_HD BallEnergy regularize(const BallScan& scan) const {
    return {.power = 1, .epsilon_squared = epsilon_squared<kDimension>(scan, phase_.softness)};
  }

  /// `search_along` a Newton step from the node's position, where the ball's energy is `value`.
  [[nodiscard]] MESHSMOOTH_HD Found<Real> search(const BallEnergy& energy, double value,
                                                 const NewtonStep& newton_step) const {
    const bool regularized = energy.epsilon_squared > 0;
    double length = 1;
    if (regularized) {
      // Evaluated as the trials are, not with the derivatives' rounding.
      value = energy_at<kDimension>(team_, terms_, energy, Vec3d{0, 0, 0}, phase_.guard);
    } else {
      length = kOverRelaxation * p_norm_length(energy.power, newton_step.decrement);
    }
    return search_along(
        terms_.position(), length * newton_step.direction,
        regularized || newton_step.decrement > kStretchDecrement, value,
        [&](Vec3<Real> position) {
          return kBound ? project(around_, displacement_limit_, node_, position) : position;
        },
        [&](Vec3<Real> position) {
          if (kBound && phase_.facets &&
              !keeps_facets(team_, around_.sliding, terms_.positions(), node_, position)) {
            return HUGE_VAL;
          }
          const Vec3d d = vec3_cast<double>(position) - vec3_cast<double>(terms_.position());
          const double found = energy_at<kDimension>(team_, terms_, energy, d, phase_.guard);
          if constexpr (kDimension == 3 && !Terms::kTetrahedra) {
            if (phase_.guard && found < value &&
                !keeps_jacobians(team_, around_, terms_.positions(), node_, position)) {
              return HUGE_VAL;
            }
          }
          return anchored(energy) ? found + anchor_->energy(vec3_cast<double>(position)) : found;
        });
  }

  /// Refinement and repair leave anchors out.
  [[nodiscard]] MESHSMOOTH_HD bool anchored(const BallEnergy& energy) const {
    return anchor_ != nullptr && phase_.poor == 0 && energy.epsilon_squared == 0;
  }

  /// Newton's method on the p-norm of f: the direction of the sum's step, but longer.
  [[nodiscard]] static MESHSMOOTH_HD double p_norm_length(int power, double decrement) {
    const double shortening = 1 - (power - 1) * decrement;
    return 1 / (shortening > 0.1 ? shortening : 0.1);
  }

  const Team& team_;
  const Surroundings& around_;
  Terms& terms_;
  std::size_t node_;
  const NodeConstraint* constraint_;
  const Anchor* anchor_;
  Vec3d normal_;
  const OptimizePhase& phase_;
  const DisplacementLimit<Real>& displacement_limit_;
};

/// The visit of a node whose `kCapacity` corners are stored per thread of the team.
template <int kDimension, int kCapacity, class Team, class P>
MESHSMOOTH_HD Visit<typename P::Real> optimize_node(
    const Team& team, const Surroundings& around, const P& x, std::size_t node,
    const OptimizePhase& phase, const DisplacementLimit<typename P::Real>& displacement_limit) {
  using Real = typename P::Real;
  Vec3d normal{0, 0, 0};
  if constexpr (kDimension == 2) {
    normal = node_normal(team, around, node);
    if (normal == Vec3d{0, 0, 0}) return Visit<Real>{.position = x[node]};
  }
  BallTerms<kDimension, kCapacity, Team, P> terms(team, around, x, node, normal);
  return NodeOptimizer<kDimension, true, Team, decltype(terms)>(team, around, terms, node, normal,
                                                                phase, displacement_limit)
      .visit();
}

}  // namespace meshsmooth::detail
