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

TEST(SmoothOptions, OptimizeByCoresDefaultsWithoutFlags) {
  const SmoothOptions options = parse({});

  EXPECT_EQ(std::get<Optimize>(options.method).goal, Goal::balanced);
  EXPECT_EQ(std::get<Optimize>(options.method).target_quality, 0);
  EXPECT_FALSE(options.movement_limit);
  EXPECT_FALSE(options.history);
  EXPECT_EQ(options.max_iterations, SmoothOptions{}.max_iterations);
  EXPECT_EQ(options.tolerance.value, SmoothOptions{}.tolerance.value);
  EXPECT_TRUE(options.tolerance.relative);
  EXPECT_TRUE(options.guard);
  EXPECT_EQ(options.form, Form::automatic);
  EXPECT_EQ(options.boundary, BoundaryPolicy::fixed);
  EXPECT_EQ(options.tangled, TangledPolicy::repair);
  EXPECT_FALSE(options.compute_budget);
}

TEST(SmoothOptions, LeaveTheIterationLimitToTheMethod) {
  EXPECT_EQ(iteration_limit(parse({"--method", "taubin"})), 20);
  EXPECT_EQ(iteration_limit(parse({"--method", "hc-laplacian"})), 10);
  EXPECT_EQ(iteration_limit(parse({"--method", "laplacian"})), 1000);
  EXPECT_EQ(iteration_limit(parse({"--method", "taubin", "--iterations", "7"})), 7);
  EXPECT_EQ(iteration_limit(parse({"--method", "windowed-sinc"})), 20);
}

// Whatever core declares of a method can be asked for here, with the default in the help.
TEST(SmoothOptions, HaveAFlagForEveryFieldOfEveryMethod) {
  CLI::App app;
  SmoothFlags flags;
  add_smooth_flags(app, flags);
  const std::string help = app.help();
  CLI::App moving;
  add_move_flags(moving, flags);
  for_each_method([&]<class M>(const M&) {
    const CLI::App& command = std::is_same_v<M, Move> ? moving : app;
    for_each_field<M>([&](const auto& field) {
      if (field.flag.empty()) return;  // chosen by the call, which files have no place for
      EXPECT_NE(command.get_option_no_throw(std::string(field.flag)), nullptr) << field.flag;
    });
  });
  EXPECT_EQ(app.get_option_no_throw("--least-step"), nullptr);
  EXPECT_THAT(help, ::testing::HasSubstr("below minus lambda [-0.6732]"));
  EXPECT_THAT(help, ::testing::HasSubstr("[balanced]"));
  EXPECT_THAT(help,
              ::testing::HasSubstr("[taubin 20, hc-laplacian 10, windowed-sinc 20, others 1000]"));
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
                                       "--movement-limit",
                                       "0.75",
                                       "--history",
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
  EXPECT_EQ(options.movement_limit.value().value, 0.75);
  EXPECT_FALSE(options.movement_limit.value().relative);
  EXPECT_TRUE(options.history);
  EXPECT_EQ(options.compute_budget, std::chrono::milliseconds(1500));
}

TEST(SmoothOptions, GiveEachMethodItsOwnParameters) {
  const auto weighted = std::get<Laplacian>(parse({"--method", "weighted-laplacian"}).method);
  const auto taubin =
      std::get<Taubin>(parse({"--method", "taubin", "--lambda", "0.3", "--mu", "-0.35"}).method);
  const auto hc = std::get<HcLaplacian>(
      parse({"--method", "hc-laplacian", "--alpha", "0.1", "--beta", "0.6"}).method);

  const auto optimize =
      std::get<Optimize>(parse({"--goal", "worst", "--target-quality", "0.3"}).method);

  EXPECT_EQ(optimize.goal, Goal::worst);
  EXPECT_EQ(optimize.target_quality, 0.3);
  EXPECT_EQ(std::get<Optimize>(parse({"--goal", "average"}).method).goal, Goal::average);
  EXPECT_EQ(weighted.weighting, Weighting::inverse_edge_length);
  EXPECT_EQ(taubin.lambda, 0.3);
  EXPECT_EQ(taubin.mu, -0.35);
  const auto sinc = std::get<WindowedSinc>(
      parse({"--method", "windowed-sinc", "--pass-band", "0.05", "--window", "hamming"}).method);
  EXPECT_EQ(sinc.pass_band, 0.05);
  EXPECT_EQ(sinc.window, Window::hamming);
  EXPECT_EQ(hc.alpha, 0.1);
  EXPECT_EQ(hc.beta, 0.6);
}

TEST(SmoothOptions, RefuseWhatTheMethodDoesNotHave) {
  EXPECT_EQ(exit_code({"--method", "laplacian", "--lambda", "0.5"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--method", "taubin", "--relaxation", "0.5"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--lambda", "0.5"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--method", "smart-laplacian", "--goal", "worst"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--method", "laplacian", "--target-quality", "0.3"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--form", "jacobi"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--form", "asynchronous"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--form", "gauss-seidel"}), ExitCode::done);
  EXPECT_EQ(exit_code({"--method", "hc-laplacian", "--form", "gauss-seidel"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--method", "smart-laplacian", "--form", "jacobi"}), ExitCode::done);
}

TEST(SmoothOptions, NameTheFlagThatDoesNotBelong) {
  try {
    parse({"--form", "asynchronous"});
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                ::testing::HasSubstr("--form asynchronous is not an option of --method "
                                     "optimize"));
  }
}

TEST(SmoothOptions, TakeAMovementLimitAsALengthOrAShare) {
  const MovementLimit share = parse({"--movement-limit", "2.5%"}).movement_limit.value();

  EXPECT_EQ(share.value, 0.025);
  EXPECT_TRUE(share.relative);
  for (const char* wrong : {"0", "-1", "0%", "nan", "%", "2 %", "2mm", "1e999"}) {
    EXPECT_EQ(exit_code({"--movement-limit", wrong}), ExitCode::usage) << wrong;
  }
}

TEST(SmoothOptions, TakeABudgetOfAnyLength) {
  EXPECT_EQ(parse({"--compute-budget", "1e300"}).compute_budget, std::chrono::nanoseconds::max());
  EXPECT_EQ(parse({"--compute-budget", "inf"}).compute_budget, std::chrono::nanoseconds::max());
}

TEST(SmoothOptions, RefuseUnknownWordsAndValuesOutOfRange) {
  EXPECT_EQ(exit_code({"--method", "magic"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--form", "magic"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--guard", "maybe"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--iterations", "-1"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--iterations", "many"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--tolerance", "-1"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--tolerance", "nan"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--method", "laplacian", "--relaxation", "1.5"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--compute-budget", "0"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--compute-budget", "nan"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--target-quality", "1"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--goal", "best"}), ExitCode::usage);
  EXPECT_EQ(exit_code({"--tolerance", "1", "--absolute-tolerance", "1"}), ExitCode::usage);
}

}  // namespace
}  // namespace meshsmooth::cli
