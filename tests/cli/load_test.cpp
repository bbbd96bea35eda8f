#include "bench/load.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {
namespace {

LoadSample ok(double end, double latency) {
  return {.end = end,
          .latency = latency,
          .outcome = Outcome::ok,
          .reason = "",
          .bytes_up = 1'000'000,
          .bytes_down = 500'000};
}

TEST(Percentile, IsTheLeastValueNotBelowTheShare) {
  std::vector<double> values(1000);
  std::iota(values.rbegin(), values.rend(), 1.0);  // 1000 … 1
  EXPECT_EQ(percentile(values, 0.5), 500);
  EXPECT_EQ(percentile(values, 0.9), 900);
  EXPECT_EQ(percentile(values, 0.99), 990);
  EXPECT_EQ(percentile(values, 0.999), 999);
  EXPECT_EQ(percentile(values, 1), 1000);
  EXPECT_EQ(percentile({7}, 0.5), 7);
  EXPECT_EQ(percentile({1, 2}, 0.51), 2);
  EXPECT_EQ(percentile({}, 0.5), 0);
}

TEST(Figures, CountWhatEndedWithinTheTimeByOutcomeAndReason) {
  const std::vector<LoadSample> samples = {
      ok(0.5, 1),
      ok(1.0, 0.01),
      ok(2.9, 0.03),
      ok(3.0, 1),
      {.end = 1.5, .latency = 9, .outcome = Outcome::refused, .reason = "QUEUE_FULL"},
      {.end = 1.6, .latency = 9, .outcome = Outcome::refused, .reason = "QUEUE_FULL"},
      {.end = 1.7, .latency = 9, .outcome = Outcome::failed, .reason = "INTERNAL"},
      {.end = 9, .latency = 9, .outcome = Outcome::failed, .reason = "later"}};

  const LoadFigures figures = figures_of(samples, 1, 3);

  EXPECT_EQ(figures.ok_count, 2);
  EXPECT_EQ(figures.refused_count, 2);
  EXPECT_EQ(figures.failed_count, 1);
  EXPECT_EQ(figures.refused, (std::map<std::string, std::int64_t>{{"QUEUE_FULL", 2}}));
  EXPECT_EQ(figures.failed, (std::map<std::string, std::int64_t>{{"INTERNAL", 1}}));
  EXPECT_DOUBLE_EQ(figures.jobs_per_second, 1);
  EXPECT_DOUBLE_EQ(figures.megabytes_up_per_second, 1);
  EXPECT_DOUBLE_EQ(figures.megabytes_down_per_second, 0.5);
  EXPECT_EQ(figures.p50, 0.01);
  EXPECT_EQ(figures.max, 0.03);  // of those that were ok
}

LoadFigures window(double rate, double p50) {
  LoadFigures figures;
  figures.ok_count = 10;
  figures.jobs_per_second = rate;
  figures.p50 = p50;
  return figures;
}

TEST(Steady, IsALoadWhoseLastThreeWindowsAreWithinTenPercent) {
  EXPECT_FALSE(is_steady({}));
  EXPECT_FALSE(is_steady(std::vector{window(100, 1), window(100, 1)}));
  EXPECT_TRUE(is_steady(std::vector{window(100, 1), window(100, 1), window(100, 1)}));
  EXPECT_TRUE(is_steady(std::vector{window(10, 9), window(95, 1), window(100, 1), window(109, 1)}));
  EXPECT_FALSE(is_steady(std::vector{window(80, 1), window(100, 1), window(100, 1)}));
  EXPECT_FALSE(is_steady(std::vector{window(100, 1), window(100, 1), window(100, 1.3)}));
  EXPECT_FALSE(
      is_steady(std::vector{window(100, 1), window(100, 1), window(100, 1), window(50, 1)}));
  LoadFigures nothing;
  EXPECT_FALSE(is_steady(std::vector{nothing, nothing, nothing}));
}

TEST(LoadSize, IsNodesAndAWeight) {
  EXPECT_EQ(parse_load_size("5000").node_count, 5000U);
  EXPECT_EQ(parse_load_size("5000").weight, 1);
  EXPECT_EQ(parse_load_size("100000:0.25").node_count, 100'000U);
  EXPECT_EQ(parse_load_size("100000:0.25").weight, 0.25);
  for (const char* text :
       {"", "x", "10", "5000:", "5000:0", "5000:-1", "5000:2x", "-5000", "1e9"}) {
    EXPECT_THROW((void)parse_load_size(text), InvalidOption) << text;
  }
}

}  // namespace
}  // namespace meshsmooth::cli
