#pragma once

// Made by scripts/tables from proto/declaration; do not edit.
// clang-format off

#include <array>
#include <string_view>
#include <tuple>

#include "meshsmooth/method_field.hpp"

namespace meshsmooth {

template <>
struct MethodTraits<Laplacian> {
  static constexpr std::string_view name = "laplacian";
  static constexpr int default_iterations = 1000;
  static constexpr std::array forms = {Form::jacobi, Form::gauss_seidel, Form::asynchronous};
  static constexpr std::string_view form_reason = "";
  static constexpr auto fields = std::make_tuple(
      ChoiceField<Laplacian, Weighting>{"weighting", &Laplacian::weighting, kEnumNames<Weighting>, "--weighting", "Weights of the neighbours"},
      NumberField<Laplacian>{"relaxation_factor", &Laplacian::relaxation, {.lower = 0, .upper = 1, .lower_included = false}, "above 0 and at most 1", "--relaxation", "Share of the step that is taken, (0, 1]", nullptr, false});
};

template <>
struct MethodTraits<SmartLaplacian> {
  static constexpr std::string_view name = "smart_laplacian";
  static constexpr int default_iterations = 1000;
  static constexpr std::array forms = {Form::gauss_seidel, Form::jacobi, Form::asynchronous};
  static constexpr std::string_view form_reason = "";
  static constexpr auto fields = std::make_tuple(
      ChoiceField<SmartLaplacian, Weighting>{"weighting", &SmartLaplacian::weighting, kEnumNames<Weighting>, "--weighting", "Weights of the neighbours"},
      NumberField<SmartLaplacian>{"relaxation_factor", &SmartLaplacian::relaxation, {.lower = 0, .upper = 1, .lower_included = false}, "above 0 and at most 1", "--relaxation", "Share of the step that is taken, (0, 1]", nullptr, false});
};

template <>
struct MethodTraits<Taubin> {
  static constexpr std::string_view name = "taubin";
  static constexpr int default_iterations = 20;
  static constexpr std::array forms = {Form::jacobi, Form::gauss_seidel, Form::asynchronous};
  static constexpr std::string_view form_reason = "";
  static constexpr auto fields = std::make_tuple(
      NumberField<Taubin>{"lambda", &Taubin::lambda, {.lower = 0, .upper = 1, .lower_included = false}, "above 0 and at most 1", "--lambda", "Factor of the first step, (0, 1]", nullptr, false},
      NumberField<Taubin>{"mu", &Taubin::mu, {}, "finite and below minus lambda", "--mu", "Factor of the second step, below minus lambda", [](const Taubin& m) { return m.mu < -m.lambda; }, false});
};

template <>
struct MethodTraits<HcLaplacian> {
  static constexpr std::string_view name = "hc_laplacian";
  static constexpr int default_iterations = 10;
  static constexpr std::array forms = {Form::jacobi};
  static constexpr std::string_view form_reason = "pushes back all nodes together";
  static constexpr auto fields = std::make_tuple(
      NumberField<HcLaplacian>{"alpha", &HcLaplacian::alpha, {.lower = 0, .upper = 1}, "from 0 to 1", "--alpha", "Weight of the original position, [0, 1]", nullptr, false},
      NumberField<HcLaplacian>{"beta", &HcLaplacian::beta, {.lower = 0, .upper = 1}, "from 0 to 1", "--beta", "Share of the node's own difference, [0, 1]", nullptr, false});
};

template <>
struct MethodTraits<Optimize> {
  static constexpr std::string_view name = "optimize";
  static constexpr int default_iterations = 1000;
  static constexpr std::array forms = {Form::gauss_seidel};
  static constexpr std::string_view form_reason = "evaluates each move at the newest positions of the neighbours";
  static constexpr auto fields = std::make_tuple(
      ChoiceField<Optimize, Goal>{"goal", &Optimize::goal, kEnumNames<Goal>, "--goal", "Elements to improve: all, the worst, or both"},
      NumberField<Optimize>{"target_quality", &Optimize::target_quality, {.lower = 0, .upper = 1, .upper_included = false}, "0 or more and below 1", "--target-quality", "Worst mean ratio of movable elements that ends the run, [0, 1)", nullptr, true},
      ChoiceField<Optimize, Target>{"target", &Optimize::target, kEnumNames<Target>, "--target", "Shape that elements aim at"},
      NumberField<Optimize>{"stay", &Optimize::stay, {.lower = 0}, "finite and 0 or more", "--stay", "Weight that holds nodes at their input positions, 0 or more", nullptr, false});
};

template <>
struct MethodTraits<WindowedSinc> {
  static constexpr std::string_view name = "windowed_sinc";
  static constexpr int default_iterations = 20;
  static constexpr std::array forms = {Form::jacobi};
  static constexpr std::string_view form_reason = "sums terms that hold for all nodes together";
  static constexpr auto fields = std::make_tuple(
      ChoiceField<WindowedSinc, Window>{"window", &WindowedSinc::window, kEnumNames<Window>, "--window", "Window of the filter's series"},
      NumberField<WindowedSinc>{"pass_band", &WindowedSinc::pass_band, {.lower = 0.001, .upper = 2}, "from 0.001 to 2", "--pass-band", "Eigenvalue of the ring operator below which the shape stays, [0.001, 2]", nullptr, false});
};

template <>
struct MethodTraits<Move> {
  static constexpr std::string_view name = "move";
  static constexpr int default_iterations = 10000;
  static constexpr std::array forms = {Form::gauss_seidel};
  static constexpr std::string_view form_reason = "evaluates each move at the newest positions of the neighbours";
  static constexpr auto fields = std::make_tuple(
      ChoiceField<Move, Target>{"target", &Move::target, kEnumNames<Target>, "--target", "Shape that elements aim at"},
      NumberField<Move>{"least_step", &Move::least_step, {.lower = 0, .upper = 1, .lower_included = false}, "above 0 and at most 1", "--least-step", "Smallest share of the motion that is tried, (0, 1]", nullptr, false},
      ChoiceField<Move, Start>{"start", &Move::start, kEnumNames<Start>, "--start", "Start of the solver; warm: from earlier motions of a session"},
      ChoiceField<Move, Derivative>{"derivative", &Move::derivative, kEnumNames<Derivative>, "", "What is computed"});
};

/// A method with other defaults, by a name of its own.
struct MethodPreset {
  std::string_view name;  // as on the command line
  Method method;
};

inline const std::array kMethodPresets = {
    MethodPreset{"weighted-laplacian", Laplacian{.weighting = Weighting::inverse_edge_length}},
};

}  // namespace meshsmooth
