#pragma once

#include "smooth/ball_energy.hpp"

namespace meshsmooth::detail {

/// What the visits of a run of sweeps do.
struct OptimisePhase {
  int power = 2;      // of the energy of valid balls, a power of two
  double poor = 0;    // visit only balls whose worst inverse mean ratio is above
  bool guard = true;  // in a tangled ball valid corners stay valid
};

/// What one visit did.
template <class Real>
struct Visit {
  Vec3<Real> place;
  double gain = 0;       // relative fall of the ball's energy to the power of 1/p
  bool tangled = false;  // a corner is not certainly positive
  bool held = false;     // it should move, but nothing tried was better
};

/// What must be won for a move to be taken: more than rounding can feign.
inline constexpr double kLeastFall = 1e-12;
/// A ball whose Newton step promises less is at rest.
inline constexpr double kRestDecrement = 4e-6;
/// Above it the step is tried at several times its length.
inline constexpr double kStretchDecrement = 0.1;
/// Over-relaxation: neighbours move too.
inline constexpr double kOverRelaxation = 1.4;

/// The best place found along a direction.
template <class Real>
struct Found {
  Vec3<Real> place;
  double value;
};

/// Tries 1, 1/2, … 1/32 of `step` from `before`; after a whole step 2 and 4 times it, if
/// `stretch`. `hold(place)` gives the place as it will be stored, which is judged;
/// `judge(place)` is what is to fall, `value` what it is at `before`.
template <class Real, class Hold, class Judge>
MESHSMOOTH_HD Found<Real> search_along(Vec3<Real> before, Vec3d step, bool stretch, double value,
                                       const Hold& hold, const Judge& judge) {
  Found<Real> best{before, value};
  const Vec3d origin = vec3_cast<double>(before);
  const auto improves = [&](double length) {
    const Vec3<Real> place = hold(vec3_cast<Real>(origin + length * step));
    if (place == best.place) return false;
    const double found = judge(place);
    if (!(found < best.value - kLeastFall * std::abs(best.value))) return false;
    best = {place, found};
    return true;
  };
  if (improves(1.0)) {
    if (stretch && improves(2.0)) improves(4.0);
    return best;
  }
  for (double length = 0.5; length > 0.03 && !improves(length); length /= 2) {
  }
  return best;
}

/// The normal of the plane in which a surface node moves: that of the plane mesh, else
/// the mean of its ball's references; zero when there is none.
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

/// One visit of one node. Reads positions, writes none.
template <int kDimension, class Team, class Terms>
class NodeOptimiser {
 public:
  using Real = typename Terms::Real;

  MESHSMOOTH_HD NodeOptimiser(const Team& team, const Surroundings& around, Terms& terms,
                              std::size_t node, Vec3d normal, const OptimisePhase& phase,
                              const Leash<Real>& leash)
      : team_(team),
        around_(around),
        terms_(terms),
        node_(node),
        freedom_(around.slides.freedom(node)),
        normal_(normal),
        phase_(phase),
        leash_(leash) {}

  MESHSMOOTH_HD Visit<Real> visit() {
    double worst = 1;
    if (phase_.poor > 0) {
      worst = worst_inverse_ratio<kDimension>(team_, terms_, {0, 0, 0});
      if (worst <= phase_.poor) return {.place = terms_.place()};
      if (worst == HUGE_VAL) return untangle();
    }
    const BallEnergy energy{.power = phase_.power, .unit = worst};
    const BallDerivatives at = differentiate<kDimension>(team_, terms_, energy);
    return at.valid ? descend(energy, at) : untangle();
  }

 private:
  [[nodiscard]] MESHSMOOTH_HD NewtonStep newton(const BallDerivatives& at) const {
    if (freedom_ != nullptr) {
      const Vec3d direction = freedom_->bent()
                                  ? direction_on_facets(around_.slides, node_, terms_.positions())
                                  : freedom_->direction;
      return freedom_->along() ? newton_step_on_line(at, direction)
                               : newton_step_in_plane(at, direction);
    }
    return kDimension == 3 ? newton_step(at) : newton_step_in_plane(at, normal_);
  }

  /// `search_along` from where the node lies; `energy(d)` is that of the ball with the node
  /// displaced.
  template <class Energy>
  [[nodiscard]] MESHSMOOTH_HD Found<Real> search(Vec3d step, bool stretch, double value,
                                                 const Energy& energy) const {
    return search_along(
        terms_.place(), step, stretch, value,
        [&](Vec3<Real> place) { return hold(around_, leash_, node_, place); },
        [&](Vec3<Real> place) {
          if (!keeps_facets(team_, around_.slides, terms_.positions(), node_, place)) {
            return HUGE_VAL;
          }
          return energy(displacement(place));
        });
  }

  [[nodiscard]] MESHSMOOTH_HD Vec3d displacement(Vec3<Real> place) const {
    return vec3_cast<double>(place) - vec3_cast<double>(terms_.place());
  }

  /// Newton on the p-norm of f: the direction of the sum's step, but longer.
  [[nodiscard]] static MESHSMOOTH_HD double p_norm_length(int power, double decrement) {
    const double shortening = 1 - (power - 1) * decrement;
    return 1 / (shortening > 0.1 ? shortening : 0.1);
  }

  /// A valid ball: one step down its energy.
  MESHSMOOTH_HD Visit<Real> descend(const BallEnergy& energy, const BallDerivatives& at) {
    const NewtonStep newton_step = newton(at);
    const double decrement = newton_step.decrement;
    if (!(decrement >= kRestDecrement)) return {.place = terms_.place()};
    const Vec3d step =
        (kOverRelaxation * p_norm_length(energy.power, decrement)) * newton_step.direction;
    const Found<Real> found = search(step, decrement > kStretchDecrement, at.energy, [&](Vec3d d) {
      return energy_at<kDimension>(team_, terms_, energy, d, true);
    });
    return {.place = found.place,
            .gain = (at.energy - found.value) / (at.energy * energy.power),
            .held = found.place == terms_.place()};
  }

  /// A tangled ball: two steps down the regularised energy; once it is valid, the
  /// second one as in a valid ball.
  MESHSMOOTH_HD Visit<Real> untangle() {
    BallScan scan = scan_ball<kDimension>(team_, terms_);
    Visit<Real> visit{.place = terms_.place(), .gain = 1, .tangled = true, .held = true};
    for (int step = 0; step < 2; ++step) {
      const BallEnergy energy{.power = 1, .epsilon_squared = epsilon_squared<kDimension>(scan)};
      const BallDerivatives at = differentiate<kDimension>(team_, terms_, energy);
      const NewtonStep newton_step = newton(at);
      if (!(newton_step.decrement >= kRestDecrement)) break;
      // The value is taken as the trials take theirs, not with the derivatives' rounding.
      const double value =
          energy_at<kDimension>(team_, terms_, energy, Vec3d{0, 0, 0}, phase_.guard);
      const Found<Real> found = search(newton_step.direction, true, value, [&](Vec3d d) {
        return energy_at<kDimension>(team_, terms_, energy, d, phase_.guard);
      });
      if (found.place == terms_.place()) break;
      visit.place = found.place;
      visit.held = false;
      terms_.move_to(found.place);
      scan = scan_ball<kDimension>(team_, terms_);
      visit.tangled = !scan.valid;
      if (scan.valid && step == 0) {
        visit.place = descend({}, differentiate<kDimension>(team_, terms_, {})).place;
        break;
      }
    }
    return visit;
  }

  const Team& team_;
  const Surroundings& around_;
  Terms& terms_;
  std::size_t node_;
  const Freedom* freedom_;
  Vec3d normal_;
  const OptimisePhase& phase_;
  const Leash<Real>& leash_;
};

/// Where one node goes. `kCapacity` corners of its ball are kept per thread of the team.
template <int kDimension, int kCapacity, class Team, class P>
MESHSMOOTH_HD Visit<typename P::Real> optimise_node(const Team& team, const Surroundings& around,
                                                    const P& x, std::size_t node,
                                                    const OptimisePhase& phase,
                                                    const Leash<typename P::Real>& leash) {
  using Real = typename P::Real;
  Vec3d normal{0, 0, 0};
  if constexpr (kDimension == 2) {
    normal = node_normal(team, around, node);
    if (normal == Vec3d{0, 0, 0}) return Visit<Real>{.place = x[node]};
  }
  BallTerms<kDimension, kCapacity, Team, P> terms(team, around, x, node, normal);
  return NodeOptimiser<kDimension, Team, decltype(terms)>(team, around, terms, node, normal, phase,
                                                          leash)
      .visit();
}

}  // namespace meshsmooth::detail
