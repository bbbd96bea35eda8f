#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <variant>

#include "meshsmooth/methods.hpp"

/// What a user can name of a method, declared once: `validate`, the wire's codec, the command
/// line and GetServerInfo read it from here.
namespace meshsmooth {

/// An interval of numbers; an infinite end is no bound, and infinity itself is never inside.
struct Range {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  bool lower_included = true;
  bool upper_included = true;

  /// False for a NaN.
  [[nodiscard]] constexpr bool contains(double value) const {
    const bool above = lower_included ? value >= lower : value > lower;
    const bool below = upper_included ? value <= upper : value < upper;
    return above && below && value < std::numeric_limits<double>::infinity() &&
           value > -std::numeric_limits<double>::infinity();
  }
};

/// A number of a method.
template <class M>
struct NumberField {
  using Member = double M::*;  // nvcc's host code of the plain form draws a warning

  std::string_view name;  // in meshsmooth.v1
  Member member;
  Range range;
  std::string_view range_text;  // "above 0 and at most 1"
  std::string_view flag;        // of the command line
  std::string_view help;        // noun phrase with unit or range
  /// What the other fields demand besides.
  bool (*agrees)(const M&) = nullptr;
  /// Whether the wire has it in SmoothingOptions itself, not in the method's message.
  bool in_options = false;

  [[nodiscard]] bool is_valid(const M& method) const {
    return range.contains(method.*member) && (agrees == nullptr || agrees(method));
  }
};

/// A choice of a method. The enumerators count from 0 in the order of `choices`, in meshsmooth.v1
/// from 1; 0 there is the default.
template <class M, class Enum>
struct ChoiceField {
  using Member = Enum M::*;

  std::string_view name;  // in meshsmooth.v1
  Member member;
  std::span<const std::string_view> choices;  // as the command line writes them
  std::string_view flag;
  std::string_view help;
};

/// Iterations that most methods may take: they converge long before.
inline constexpr int kAmpleIterations = 1000;

/// The longest series of `WindowedSinc`. Its design costs up to 500 times as many sines.
inline constexpr int kMostFilterIterations = 10000;

/// Specialised for each method:
/// - `name`: in meshsmooth.v1, lower_snake_case;
/// - `default_iterations`: the limit when the caller sets none;
/// - `forms`: those that it has, the first when the caller chooses none;
/// - `form_reason`: why it has only these, for the error; empty when it has all;
/// - `fields`: a tuple of `NumberField` and `ChoiceField`.
template <class M>
struct MethodTraits;

namespace detail {

inline constexpr std::array<std::string_view, 4> kWeightingNames = {
    "uniform", "inverse-edge-length", "edge-length", "ball-volume"};
inline constexpr std::array<std::string_view, 3> kGoalNames = {"average", "balanced", "worst"};
inline constexpr std::array<std::string_view, 4> kTargetNames = {"automatic", "ideal", "input",
                                                                 "reference"};
inline constexpr std::array<std::string_view, 2> kStartNames = {"cold", "warm"};
inline constexpr std::array<std::string_view, 2> kWindowNames = {"nuttall", "hamming"};

inline constexpr Range kAboveZeroToOne{.lower = 0, .upper = 1, .lower_included = false};
inline constexpr Range kZeroToOne{.lower = 0, .upper = 1};

/// The fields of the two methods that average.
template <class M>
inline constexpr std::tuple kAveragingFields{
    ChoiceField<M, Weighting>{"weighting", &M::weighting, kWeightingNames, "--weighting",
                              "Weights of the neighbours"},
    NumberField<M>{"relaxation_factor", &M::relaxation, kAboveZeroToOne, "above 0 and at most 1",
                   "--relaxation", "Share of the step that is taken, (0, 1]"}};

}  // namespace detail

template <>
struct MethodTraits<Laplacian> {
  static constexpr std::string_view name = "laplacian";
  static constexpr int default_iterations = kAmpleIterations;
  static constexpr std::array forms = {Form::jacobi, Form::gauss_seidel, Form::asynchronous};
  static constexpr std::string_view form_reason = "";
  static constexpr auto& fields = detail::kAveragingFields<Laplacian>;
};

template <>
struct MethodTraits<SmartLaplacian> {
  static constexpr std::string_view name = "smart_laplacian";
  static constexpr int default_iterations = kAmpleIterations;
  static constexpr std::array forms = {Form::gauss_seidel, Form::jacobi, Form::asynchronous};
  static constexpr std::string_view form_reason = "";
  static constexpr auto& fields = detail::kAveragingFields<SmartLaplacian>;
};

/// 20 iterations are VTK's default for the same kind of filter (vtkWindowedSincPolyDataFilter). A
/// component of eigenvalue k of the mesh's Laplacian is scaled by (1 - lambda k)(1 - mu k) each:
/// after 20, noise (k >= 0.5) has at most 17 % left, and no component has grown by more than 2.2 %;
/// after 1,000 some have nearly tripled.
template <>
struct MethodTraits<Taubin> {
  static constexpr std::string_view name = "taubin";
  static constexpr int default_iterations = 20;
  static constexpr std::array forms = {Form::jacobi, Form::gauss_seidel, Form::asynchronous};
  static constexpr std::string_view form_reason = "";
  static constexpr std::tuple fields = {
      NumberField<Taubin>{"lambda", &Taubin::lambda, detail::kAboveZeroToOne,
                          "above 0 and at most 1", "--lambda", "Factor of the first step, (0, 1]"},
      NumberField<Taubin>{"mu",
                          &Taubin::mu,
                          {},
                          "finite and below minus lambda",
                          "--mu",
                          "Factor of the second step, below minus lambda",
                          [](const Taubin& method) { return method.mu < -method.lambda; }}};
};

/// With the default factors a component of eigenvalue k is scaled by 1 - k^2 / 2 each iteration:
/// after 10, k = 0.5 has 26 % left and k = 0.1 has 95 %, about what 20 of Taubin leave; many more
/// take the shape too.
template <>
struct MethodTraits<HcLaplacian> {
  static constexpr std::string_view name = "hc_laplacian";
  static constexpr int default_iterations = 10;
  static constexpr std::array forms = {Form::jacobi};
  static constexpr std::string_view form_reason = "pushes back all nodes together";
  static constexpr std::tuple fields = {
      NumberField<HcLaplacian>{"alpha", &HcLaplacian::alpha, detail::kZeroToOne, "from 0 to 1",
                               "--alpha", "Weight of the original position, [0, 1]"},
      NumberField<HcLaplacian>{"beta", &HcLaplacian::beta, detail::kZeroToOne, "from 0 to 1",
                               "--beta", "Share of the node's own difference, [0, 1]"}};
};

template <>
struct MethodTraits<Optimize> {
  static constexpr std::string_view name = "optimize";
  static constexpr int default_iterations = kAmpleIterations;
  static constexpr std::array forms = {Form::gauss_seidel};
  static constexpr std::string_view form_reason =
      "evaluates each move at the newest positions of the neighbours";
  static constexpr std::tuple fields = {
      ChoiceField<Optimize, Goal>{"goal", &Optimize::goal, detail::kGoalNames, "--goal",
                                  "Elements to improve: all, the worst, or both"},
      NumberField<Optimize>{"target_quality",
                            &Optimize::target_quality,
                            {.lower = 0, .upper = 1, .upper_included = false},
                            "0 or more and below 1",
                            "--target-quality",
                            "Worst mean ratio of movable elements that ends the run, [0, 1)",
                            nullptr,
                            true},
      ChoiceField<Optimize, Target>{"target", &Optimize::target, detail::kTargetNames, "--target",
                                    "Shape that elements aim at"},
      NumberField<Optimize>{"stay",
                            &Optimize::stay,
                            {.lower = 0},
                            "finite and 0 or more",
                            "--stay",
                            "Weight that holds nodes at their input positions, 0 or more"}};
};

/// VTK's defaults (vtkWindowedSincPolyDataFilter from 9.4 on): 20 iterations keep 99.9 % of a
/// component at the end of the pass band and 98 % at twice its eigenvalue, 5 % at ten times.
template <>
struct MethodTraits<WindowedSinc> {
  static constexpr std::string_view name = "windowed_sinc";
  static constexpr int default_iterations = 20;
  static constexpr std::array forms = {Form::jacobi};
  static constexpr std::string_view form_reason = "sums terms that hold for all nodes together";
  static constexpr std::tuple fields = {
      ChoiceField<WindowedSinc, Window>{"window", &WindowedSinc::window, detail::kWindowNames,
                                        "--window", "Window of the filter's series"},
      NumberField<WindowedSinc>{"pass_band",
                                &WindowedSinc::pass_band,
                                {.lower = 0.001, .upper = 2},
                                "from 0.001 to 2",
                                "--pass-band",
                                "Eigenvalue of the ring operator below which the shape stays, "
                                "[0.001, 2]"}};
};

template <>
struct MethodTraits<Move> {
  static constexpr std::string_view name = "move";
  static constexpr int default_iterations = 10 * kAmpleIterations;  // of all steps
  static constexpr std::array forms = {Form::gauss_seidel};
  static constexpr std::string_view form_reason = MethodTraits<Optimize>::form_reason;
  static constexpr std::tuple fields = {
      ChoiceField<Move, Target>{"target", &Move::target, detail::kTargetNames, "--target",
                                "Shape that elements aim at"},
      NumberField<Move>{"least_step", &Move::least_step, detail::kAboveZeroToOne,
                        "above 0 and at most 1", "--least-step",
                        "Smallest share of the motion that is tried, (0, 1]"},
      ChoiceField<Move, Start>{"start", &Move::start, detail::kStartNames, "--start",
                               "Start of the solver; warm: from earlier motions of a session"}};
};

/// Calls `visit(M{})` for each method M, in the order of `Method`.
template <class Visit>
constexpr void for_each_method(Visit&& visit) {
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    (visit(std::variant_alternative_t<I, Method>{}), ...);
  }
  (std::make_index_sequence<std::variant_size_v<Method>>{});
}

/// Calls `visit(field)` for each field of method M.
template <class M, class Visit>
constexpr void for_each_field(Visit&& visit) {
  std::apply([&](const auto&... field) { (visit(field), ...); }, MethodTraits<M>::fields);
}

/// "laplacian", "smart_laplacian", "taubin", "hc_laplacian", "optimize", "windowed_sinc",
/// "move".
[[nodiscard]] inline std::string_view method_name(const Method& method) {
  return std::visit([]<class M>(const M&) { return MethodTraits<M>::name; }, method);
}

/// The iteration limit that holds when the caller sets none.
[[nodiscard]] inline int default_iterations(const Method& method) {
  return std::visit([]<class M>(const M&) { return MethodTraits<M>::default_iterations; }, method);
}

/// The forms that a method has, the default first.
[[nodiscard]] inline std::span<const Form> forms_of(const Method& method) {
  return std::visit(
      []<class M>(const M&) -> std::span<const Form> { return MethodTraits<M>::forms; }, method);
}

}  // namespace meshsmooth
