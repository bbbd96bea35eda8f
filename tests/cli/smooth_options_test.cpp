#include "smooth_options.hpp"

#include <gmock/gmock.h>

#include "exit_code.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {
namespace {

/// What the flags of a command line come to.
SmoothOptions parse(std::vector<std::string> arguments) {
  CLI::App app;
  SmoothFlags flags;
  add_smooth_flags(app, flags);
  std::ranges::reverse(arguments);  // as CLI11 wants a vector
  app.parse(arguments);
  return to_smooth_options(flags);
}

ExitCode exit_code(const std::vector<std::string>& arguments) {
  try {
    parse(arguments);
  } catch (const CLI::ParseError&) {
    return ExitCode::usage;
  } catch (const std::exception& error) {
    return exit_code_of(error);
  }
  return ExitCode::done;
}

TEST(SmoothOptions, AreCoresDefaultsWithoutFlags) {
  const SmoothOptions options = parse({});

  EXPECT_TRUE(std::holds_alternative<SmartLaplacian>(options.method));
  EXPECT_EQ(options.max_iterations, SmoothOptions{}.max_iterations);
  EXPECT_EQ(options.tolerance.value, SmoothOptions{}.tolerance.value);
  EXPECT_TRUE(options.tolerance.relative);
  EXPECT_TRUE(options.guard);
  EXPECT_EQ(options.form, Form::automatic);
  EXPECT_EQ(options.boundary, BoundaryPolicy::fixed);
  EXPECT_EQ(options.tangled, TangledPolicy::repair);
  EXPECT_FALSE(options.compute_budget);
}

TEST(SmoothOptions, TakeEveryFlag) {
  const SmoothOptions options = parse({"--method",
                                       "laplacian",
                                       "--weighting",
                                       "ball-volume",
                                       "--relaxation",
                                       "0.5",
                                       "--form",
                                       "gauss-seidel",
                                       "--guard",
                                       "off",
                                       "--tangled",
                                       "refuse",
                                       "--boundary",
                                       "free",
                                       "--iterations",
                                       "12",
                                       "--absolute-tolerance",
                                       "0.25",
                                       "--compute-budget",
                                       "1.5"});

  EXPECT_EQ(std::get<Laplacian>(options.method).weighting, Weighting::ball_volume);
  EXPECT_EQ(std::get<Laplacian>(options.method).relaxation, 0.5);
  EXPECT_EQ(options.form, Form::gauss_seidel);
  EXPECT_FALSE(options.guard);
  EXPECT_EQ(options.tangled, TangledPolicy::refuse);
  EXPECT_EQ(options.boundary, BoundaryPolicy::free);
  EXPECT_EQ(options.max_iterations, 12);
  EXPECT_EQ(options.tolerance.value, 0.25);
  EXPECT_FALSE(options.tolerance.relative);
  EXPECT_EQ(options.compute_budget, std::chrono::milliseconds(1500));
}

TEST(SmoothOptions, GiveEachMethodItsOwnParameters) {
  const auto weighted = std::get<Laplacian>(parse({"--method", "weighted-laplacian"}).method);
  const auto taubin =
      std::get<Taubin>(parse({"--method", "taubin", "--lambda", "0.3", "--mu", "-0.35"}).method);
  const auto hc = std::get<HcLaplacian>(
      parse({"--method", "hc-laplacian", "--alpha", "0.1", "--beta", "0.6"}).method);

  EXPECT_EQ(weighted.weighting, Weighting::inverse_edge_length);
  EXPECT_EQ(taubin.lambda, 0.3);
  EXPECT_EQ(taubin.mu, -0.35);
  EXPECT_EQ(hc.alpha, 0.1);
  EXPECT_EQ(hc.beta, 0.6);
}

TEST(SmoothOptions, RefuseWhatTheMethodDoesNotHave) {
  EXPECT_EQ(exit_code({"--method", "laplacian", "--lambda", "0.5"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--method", "taubin", "--relaxation", "0.5"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--goal", "worst"}), ExitCode::usage);
}

TEST(SmoothOptions, RefuseUnknownWordsAndValuesOutOfRange) {
  EXPECT_EQ(exit_code({"--method", "magic"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--form", "magic"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--guard", "maybe"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--iterations", "-1"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--iterations", "many"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--tolerance", "-1"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--tolerance", "nan"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--relaxation", "1.5"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--compute-budget", "0"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--tolerance", "1", "--absolute-tolerance", "1"}), ExitCode::usage);
}

TEST(SmoothOptions, KnowOptimizeByNameButRefuseItClearly) {
  EXPECT_EQ(exit_code({"--method", "optimize", "--goal", "worst"}), ExitCode::refused);
}

}  // namespace
}  // namespace meshsmooth::cli
