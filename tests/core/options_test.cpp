#include "meshsmooth/options.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <limits>
#include <string>
#include <type_traits>

#include "meshsmooth/error.hpp"

namespace meshsmooth {
namespace {

using testing::ElementsAre;
using testing::Pair;

/// The field that `validate` rejects, or "".
std::string rejected_field(const SmoothOptions& options) {
  try {
    validate(options);
  } catch (const InvalidOption& error) {
    EXPECT_EQ(error.reason(), "OPTION_OUT_OF_RANGE");
    EXPECT_EQ(error.details().size(), 1U);
    return error.details().front().second;
  }
  return "";
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(ValidateOptions, AcceptsTheDefaultsOfEveryMethod) {
  EXPECT_EQ(rejected_field({}), "");
  EXPECT_EQ(rejected_field({.method = Laplacian{}}), "");
  EXPECT_EQ(rejected_field({.method = Taubin{}}), "");
  EXPECT_EQ(rejected_field({.method = HcLaplacian{}}), "");
  EXPECT_EQ(rejected_field({.method = Optimize{}}), "");
  EXPECT_EQ(rejected_field({.method = WindowedSinc{}}), "");
}

TEST(ValidateOptions, HoldsRelaxationAboveZeroAndAtMostOne) {
  for (const double wrong : {0.0, -0.5, 1.0000001, kNan, kInfinity}) {
    EXPECT_EQ(rejected_field({.method = Laplacian{.relaxation = wrong}}),
              "laplacian.relaxation_factor");
    EXPECT_EQ(rejected_field({.method = SmartLaplacian{.relaxation = wrong}}),
              "smart_laplacian.relaxation_factor");
  }
  EXPECT_EQ(rejected_field({.method = Laplacian{.relaxation = 1}}), "");
  EXPECT_EQ(rejected_field({.method = Laplacian{.relaxation = 1e-6}}), "");
}

TEST(ValidateOptions, HoldsTaubinsFactorsApart) {
  for (const double wrong : {0.0, -1.0, 1.5, kNan}) {
    EXPECT_EQ(rejected_field({.method = Taubin{.lambda = wrong, .mu = -2}}), "taubin.lambda");
  }
  for (const double wrong : {-0.5, -0.4, 0.6, kNan, -kInfinity}) {
    EXPECT_EQ(rejected_field({.method = Taubin{.lambda = 0.5, .mu = wrong}}), "taubin.mu");
  }
  EXPECT_EQ(rejected_field({.method = Taubin{.lambda = 0.5, .mu = -0.53}}), "");
}

TEST(ValidateOptions, BoundsAFilter) {
  for (const double wrong : {0.0, 0.0009, 2.1, kNan}) {
    EXPECT_EQ(rejected_field({.method = WindowedSinc{.pass_band = wrong}}),
              "windowed_sinc.pass_band");
  }
  EXPECT_EQ(rejected_field({.method = WindowedSinc{.pass_band = 2}, .max_iterations = 10000}), "");
  EXPECT_EQ(rejected_field({.method = WindowedSinc{}, .max_iterations = 10001}),
            "max_iteration_count");
}

TEST(ValidateOptions, HoldsHcSharesBetweenZeroAndOne) {
  for (const double wrong : {-0.1, 1.1, kNan}) {
    EXPECT_EQ(rejected_field({.method = HcLaplacian{.alpha = wrong}}), "hc_laplacian.alpha");
    EXPECT_EQ(rejected_field({.method = HcLaplacian{.beta = wrong}}), "hc_laplacian.beta");
  }
  EXPECT_EQ(rejected_field({.method = HcLaplacian{.alpha = 1, .beta = 0}}), "");
}

TEST(ValidateOptions, HoldsTheTargetQualityBelowOne) {
  for (const double wrong : {-0.1, 1.0, kNan, kInfinity}) {
    EXPECT_EQ(rejected_field({.method = Optimize{.target_quality = wrong}}), "target_quality");
  }
  EXPECT_EQ(rejected_field({.method = Optimize{.target_quality = 0.99}}), "");
}

TEST(ValidateOptions, HoldsTheMovementLimitAboveZero) {
  for (const double wrong : {0.0, -1.0, kNan, kInfinity}) {
    EXPECT_EQ(rejected_field({.movement_limit = MovementLimit{.value = wrong}}),
              "absolute_movement_limit");
    EXPECT_EQ(rejected_field({.movement_limit = MovementLimit{.value = wrong, .relative = true}}),
              "movement_limit");
  }
  EXPECT_EQ(rejected_field({.movement_limit = MovementLimit{.value = 1e-9}}), "");
}

TEST(ValidateOptions, HoldsTheFeatureAngleUpToARightOne) {
  for (const double wrong : {0.0, 0.99, 90.5, -30.0, kNan, kInfinity}) {
    EXPECT_EQ(rejected_field({.feature_angle = wrong}), "feature_angle");
  }
  EXPECT_EQ(rejected_field({.feature_angle = 1}), "");
  EXPECT_EQ(rejected_field({.feature_angle = 90}), "");
  try {
    validate({.feature_angle = 120});
    FAIL() << "nothing thrown";
  } catch (const InvalidOption& error) {
    EXPECT_STREQ(error.what(), "feature_angle is 120, it must be from 1 to 90 degrees");
  }
}

TEST(ValidateOptions, HoldsLimitsAboveZero) {
  using namespace std::chrono_literals;
  EXPECT_EQ(rejected_field({.max_iterations = -1}), "max_iteration_count");
  EXPECT_EQ(rejected_field({.max_iterations = 0}), "");
  EXPECT_EQ(rejected_field({.tolerance = {-1e-9}}), "convergence_tolerance");
  EXPECT_EQ(rejected_field({.tolerance = {kNan}}), "convergence_tolerance");
  EXPECT_EQ(rejected_field({.tolerance = {kInfinity, false}}), "absolute_tolerance");
  EXPECT_EQ(rejected_field({.tolerance = {0}}), "");
  EXPECT_EQ(rejected_field({.compute_budget = 0s}), "compute_budget");
  EXPECT_EQ(rejected_field({.compute_budget = -1s}), "compute_budget");
  EXPECT_EQ(rejected_field({.compute_budget = 1ms}), "");
}

TEST(ValidateOptions, SaysValueAndRange) {
  try {
    validate({.method = Laplacian{.relaxation = 1.5}});
    FAIL() << "nothing thrown";
  } catch (const InvalidOption& error) {
    EXPECT_STREQ(error.what(),
                 "laplacian.relaxation_factor is 1.5, it must be above 0 and at most 1");
  }
}

TEST(ValidateOptions, SaysWhichMethodsHaveOnlyOneForm) {
  const SmoothOptions wrong[] = {{.method = HcLaplacian{}, .form = Form::gauss_seidel},
                                 {.method = HcLaplacian{}, .form = Form::asynchronous},
                                 {.method = Optimize{}, .form = Form::jacobi},
                                 {.method = Optimize{}, .form = Form::asynchronous}};
  for (const SmoothOptions& options : wrong) {
    try {
      validate(options);
      FAIL() << "nothing thrown";
    } catch (const NotSupported& error) {
      EXPECT_EQ(error.reason(), "OPTION_NOT_SUPPORTED");
      EXPECT_THAT(error.details(), ElementsAre(Pair("field", "form")));
    }
  }
  EXPECT_NO_THROW(validate({.method = HcLaplacian{}, .form = Form::jacobi}));
  EXPECT_NO_THROW(validate({.method = Optimize{}, .form = Form::gauss_seidel}));
}

TEST(DefaultMethod, IsOptimize) { EXPECT_EQ(method_name(SmoothOptions{}.method), "optimize"); }

TEST(IterationLimit, IsTheMethodsOwnUnlessSet) {
  EXPECT_EQ(iteration_limit({}), 1000);
  EXPECT_EQ(iteration_limit({.method = Laplacian{}}), 1000);
  EXPECT_EQ(iteration_limit({.method = SmartLaplacian{}}), 1000);
  EXPECT_EQ(iteration_limit({.method = Taubin{}}), 20);
  EXPECT_EQ(iteration_limit({.method = HcLaplacian{}}), 10);
  EXPECT_EQ(iteration_limit({.method = WindowedSinc{}}), 20);
  EXPECT_EQ(iteration_limit({.method = Taubin{}, .max_iterations = 0}), 0);
  EXPECT_EQ(iteration_limit({.method = HcLaplacian{}, .max_iterations = 500}), 500);
}

// Each form is either accepted or has a reason why not.
TEST(MethodTraits, AgreeWithValidate) {
  for_each_method([]<class M>(const M& method) {
    const auto has = [](Form form) {
      return std::ranges::find(MethodTraits<M>::forms, form) != MethodTraits<M>::forms.end();
    };
    for (const Form form : {Form::jacobi, Form::gauss_seidel, Form::asynchronous}) {
      if (has(form)) {
        EXPECT_NO_THROW(validate({.method = method, .form = form}));
      } else {
        EXPECT_THROW(validate({.method = method, .form = form}), NotSupported);
        EXPECT_NE(MethodTraits<M>::form_reason, "");
      }
    }
    for_each_field<M>([&]<class Field>(const Field& field) {
      if constexpr (std::is_same_v<Field, NumberField<M>>) {
        M wrong = method;
        wrong.*field.member = kNan;
        EXPECT_EQ(rejected_field({.method = wrong}),
                  (field.in_options ? "" : std::string(MethodTraits<M>::name) + ".") +
                      std::string(field.name));
      }
    });
  });
}

TEST(ValidateOptions, TakesEachElementQualityMetricOnce) {
  SmoothOptions options;
  options.element_quality_metrics.assign(kQualityMetrics.begin(), kQualityMetrics.end());
  EXPECT_EQ(rejected_field(options), "");
  options.element_quality_metrics.push_back(QualityMetric::radius_ratio);
  EXPECT_EQ(rejected_field(options), "element_quality_metrics");
}

TEST(ValidateOptions, RefusesAMetricThatDecidesNothing) {
  SmoothOptions options{.method = SmartLaplacian{}, .metric = QualityMetric::scaled_jacobian};
  EXPECT_NO_THROW(validate(options));
  options.never_worse = false;
  EXPECT_THROW(validate(options), NotSupported);
  options.method = Optimize{};  // raises its least value all the same
  EXPECT_NO_THROW(validate(options));
  options = {.method = Laplacian{}, .guard = false, .metric = QualityMetric::mean_ratio};
  EXPECT_THROW(validate(options), NotSupported);
}

TEST(MethodName, IsTheNameInTheProtocol) {
  EXPECT_EQ(method_name(Laplacian{}), "laplacian");
  EXPECT_EQ(method_name(SmartLaplacian{}), "smart_laplacian");
  EXPECT_EQ(method_name(Taubin{}), "taubin");
  EXPECT_EQ(method_name(HcLaplacian{}), "hc_laplacian");
  EXPECT_EQ(method_name(Optimize{}), "optimize");
  EXPECT_EQ(method_name(WindowedSinc{}), "windowed_sinc");
}

}  // namespace
}  // namespace meshsmooth
