#include "smooth/plan/job_plan.hpp"

namespace meshsmooth::detail {
namespace {

Aim aim_of(Target target) {
  switch (target) {
    case Target::automatic:
      return Aim::boxes;
    case Target::ideal:
      return Aim::ideal;
    case Target::input:
      return Aim::input;
    case Target::reference:
      return Aim::reference;
  }
  return Aim::ideal;
}

/// Adds what is particular to a method.
class AddMethod {
 public:
  explicit AddMethod(JobPlan& plan) : plan_(plan) {}

  void operator()(const Laplacian& method) const { average(method.weighting); }
  void operator()(const SmartLaplacian& method) const {
    average(method.weighting);
    plan_.acceptance.smart = true;
  }
  // The positions before an iteration; of HC the original ones and the differences.
  void operator()(const Taubin&) const { plan_.further_positions = 1; }
  void operator()(const HcLaplacian&) const { plan_.further_positions = 2; }
  void operator()(const WindowedSinc&) const { plan_.filters = true; }
  void operator()(const Optimize& method) const { optimize(method); }
  /// Sweeps as `Optimize` does, and its input is the target.
  void operator()(const Move& method) const {
    plan_.moves = true;
    plan_.derivative = method.derivative;
    plan_.tangled = TangledPolicy::repair;
    optimize({.target = method.target == Target::ideal ? Target::ideal : Target::input});
  }

 private:
  void average(Weighting weighting) const {
    plan_.averages = true;
    plan_.uniform_mean = weighting == Weighting::uniform;
    plan_.needs_balls = weighting == Weighting::ball_volume;
  }
  void optimize(const Optimize& method) const {
    plan_.optimizer = method;
    plan_.aim = aim_of(method.target);
    plan_.anchor_weight = method.stay;
    plan_.stays_on_surface = true;
  }

  JobPlan& plan_;
};

}  // namespace

JobPlan plan_job(const SmoothOptions& options) {
  JobPlan plan{.options = options};
  plan.form = options.form != Form::automatic ? options.form : forms_of(options.method).front();
  plan.acceptance = {
      .guard = options.guard, .smart = false, .facets = options.boundary == BoundaryPolicy::slide};
  plan.iteration_limit = iteration_limit(options);
  plan.tangled = options.tangled;
  std::visit(AddMethod(plan), options.method);
  plan.colours = plan.form == Form::gauss_seidel;
  plan.needs_balls = plan.needs_balls || plan.colours || plan.acceptance.active();
  // Not of a motion, whose boundary moves, nor without the guard, which already allows inverted
  // elements, nor where a reference has the shapes.
  plan.keeps_quality = options.never_worse && options.guard && !plan.moves &&
                       plan.aim != Aim::reference && plan.iteration_limit > 0;
  // `Goal::worst` gives the mean up for the worst elements.
  plan.keeps_mean = !plan.optimizer || plan.optimizer->goal != Goal::worst;
  plan.raises_jacobians = plan.improves() && plan.optimizer->goal != Goal::average &&
                          options.metric == QualityMetric::scaled_jacobian;
  plan.recounts_poor = options.report_below.has_value() && plan.keeps_quality;
  // The result must not depend on what is reported.
  plan.evaluated_detail = plan.keeps_quality ? QualityDetail::full : options.quality_detail;
  return plan;
}

}  // namespace meshsmooth::detail
