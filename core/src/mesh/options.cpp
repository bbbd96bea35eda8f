#include "meshsmooth/options.hpp"

#include <cmath>
#include <sstream>
#include <string>

#include "meshsmooth/error.hpp"

namespace meshsmooth {
namespace {

[[noreturn]] void throw_out_of_range(const std::string& field, double value,
                                     const std::string& range) {
  std::ostringstream message;
  message << field << " is " << value << ", it must be " << range;
  throw InvalidOption("OPTION_OUT_OF_RANGE", message.str(), {{"field", field}});
}

// Written so that a NaN fails.
void need(bool in_range, const std::string& field, double value, const std::string& range) {
  if (!in_range) throw_out_of_range(field, value, range);
}

void validate_relaxation(const std::string& method, double relaxation) {
  need(relaxation > 0 && relaxation <= 1, method + ".relaxation_factor", relaxation,
       "above 0 and at most 1");
}

struct ValidateMethod {
  void operator()(const Laplacian& m) const { validate_relaxation("laplacian", m.relaxation); }
  void operator()(const SmartLaplacian& m) const {
    validate_relaxation("smart_laplacian", m.relaxation);
  }
  void operator()(const Taubin& m) const {
    need(m.lambda > 0 && m.lambda <= 1, "taubin.lambda", m.lambda, "above 0 and at most 1");
    need(m.mu < -m.lambda && std::isfinite(m.mu), "taubin.mu", m.mu,
         "finite and below minus lambda");
  }
  void operator()(const HcLaplacian& m) const {
    need(m.alpha >= 0 && m.alpha <= 1, "hc_laplacian.alpha", m.alpha, "from 0 to 1");
    need(m.beta >= 0 && m.beta <= 1, "hc_laplacian.beta", m.beta, "from 0 to 1");
  }
  void operator()(const Optimize& m) const {
    need(m.target_quality >= 0 && m.target_quality < 1, "target_quality", m.target_quality,
         "0 or more and below 1");
  }
};

struct MethodName {
  std::string_view operator()(const Laplacian&) const { return "laplacian"; }
  std::string_view operator()(const SmartLaplacian&) const { return "smart_laplacian"; }
  std::string_view operator()(const Taubin&) const { return "taubin"; }
  std::string_view operator()(const HcLaplacian&) const { return "hc_laplacian"; }
  std::string_view operator()(const Optimize&) const { return "optimize"; }
};

}  // namespace

std::string_view method_name(const Method& method) { return std::visit(MethodName{}, method); }

void validate(const SmoothOptions& options) {
  std::visit(ValidateMethod{}, options.method);
  need(options.max_iterations >= 0, "max_iteration_count", options.max_iterations, "0 or more");
  const double tolerance = options.tolerance.value;
  need(tolerance >= 0 && std::isfinite(tolerance),
       options.tolerance.relative ? "convergence_tolerance" : "absolute_tolerance", tolerance,
       "finite and 0 or more");
  need(options.feature_angle >= 1 && options.feature_angle <= 90, "feature_angle",
       options.feature_angle, "from 1 to 90 degrees");
  if (options.compute_budget) {
    const double seconds = std::chrono::duration<double>(*options.compute_budget).count();
    need(seconds > 0, "compute_budget", seconds, "above 0 seconds");
  }
  if (options.movement_limit) {
    const double limit = options.movement_limit->value;
    need(limit > 0 && std::isfinite(limit),
         options.movement_limit->relative ? "movement_limit" : "absolute_movement_limit", limit,
         "finite and above 0");
  }
  if (std::holds_alternative<Optimize>(options.method) && options.form != Form::automatic &&
      options.form != Form::gauss_seidel) {
    throw NotSupported("OPTION_NOT_SUPPORTED",
                       "optimize judges each move by the newest places of the nodes around, it "
                       "has only the gauss_seidel form",
                       {{"field", "form"}});
  }
  if (std::holds_alternative<HcLaplacian>(options.method) && options.form != Form::automatic &&
      options.form != Form::jacobi) {
    throw NotSupported("OPTION_NOT_SUPPORTED",
                       "hc_laplacian pushes back all nodes together, it has only the jacobi form",
                       {{"field", "form"}});
  }
}

}  // namespace meshsmooth
