#include "summary_report.hpp"

#include <gmock/gmock.h>

#include "quality_report.hpp"
#include "readable.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::cli {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

SmoothSummary summary_of(std::int64_t before, std::int64_t after, std::int64_t total = 633220) {
  SmoothSummary summary;
  summary.quality_before.element_count = total;
  summary.quality_before.inverted_count = before;
  summary.quality_after.element_count = total;
  summary.quality_after.inverted_count = after;
  return summary;
}

SmoothOptions plain_laplacian() {
  SmoothOptions options;
  options.method = Laplacian{};
  options.guard = false;
  return options;
}

TEST(DescribeInverted, SaysPlainlyWhatPlainLaplacianDid) {
  EXPECT_EQ(describe_inverted(summary_of(0, 11013), plain_laplacian()),
            "11,013 of 633,220 elements (1.7 %) are inverted; they were valid before: plain "
            "laplacian without the guard does this");
}

TEST(DescribeInverted, KnowsTheOtherCases) {
  EXPECT_EQ(describe_inverted(summary_of(0, 0), {}), "no element is inverted");
  EXPECT_EQ(describe_inverted(summary_of(12, 0), {}),
            "no element is inverted any more; 12 were before");
  EXPECT_EQ(describe_inverted(summary_of(1, 1, 8), {}),
            "1 of 8 elements (12.5 %) is inverted; 1 was before");
  EXPECT_EQ(describe_inverted(summary_of(8, 8, 8), {}),
            "8 of 8 elements (100.0 %) are inverted; 8 were before");
  SmoothSummary locked = summary_of(5, 3);
  locked.locked.inverted_count = 2;
  EXPECT_EQ(describe_inverted(locked, {}),
            "3 of 633,220 elements (< 0.1 %) are inverted; 5 were before; 2 of them locked by "
            "fixed nodes");
}

TEST(DescribeSummary, NamesStopReasonQualityLockedNodesAndTimes) {
  client::SmoothReport report;
  report.summary = summary_of(0, 0);
  Convergence& convergence = report.summary.convergence;
  convergence.iteration_count = 87;
  convergence.last_max_displacement = 9e-5;
  convergence.tolerance = 1.7e-4;
  convergence.held_node_count = 12;
  report.summary.quality_before = measure_quality(test::tet_ball());
  report.summary.quality_after = report.summary.quality_before;
  report.summary.locked = {.element_count = 224,
                           .inverted_count = 0,
                           .worst = ElementQuality{.element = 4, .mean_ratio = 0.0123}};
  report.summary.nodes = {
      .total = 100000, .boundary = 12000, .fixed = 12003, .isolated = 1, .moved = 87997};
  report.summary.times.iterate_seconds = 1.5;
  report.summary.backend = "cpu";
  report.summary.thread_count = 2;

  const std::string text = describe_summary(report, {.method = SmartLaplacian{}}, 1.92,
                                            [](std::int64_t id) { return id + 100; });

  EXPECT_THAT(text, AllOf(HasSubstr("converged after 87 iterations (largest move 9e-05, tolerance "
                                    "0.00017)\n"),
                          HasSubstr("mean ratio       min"), HasSubstr("dihedral angle   min"),
                          HasSubstr("radius ratio     min"), HasSubstr("scaled jacobian  min"),
                          Not(HasSubstr("\n  angle")), HasSubstr("no element is inverted\n")));
  EXPECT_THAT(text, HasSubstr("224 elements are locked: all nodes fixed, no smoothing can repair "
                              "them; the worst, element 104, has mean ratio 0.0123\n"));
  EXPECT_THAT(text, HasSubstr("100,000 nodes: 87,997 moved, 12,003 fixed (12,000 on the boundary), "
                              "1 in no element; the guard held 12 back in the last sweep\n"));
  EXPECT_THAT(text, HasSubstr("time 1.92 s: iterate 1.5 s (cpu, 2 threads)\n"));
}

std::string report_of(const SmoothSummary& summary, const SmoothOptions& options) {
  client::SmoothReport report;
  report.summary = summary;
  return describe_summary(report, options, 1, [](std::int64_t id) { return id; });
}

TEST(DescribeSummary, NamesTheToleranceThatOptimizeGoesBy) {
  SmoothSummary summary = summary_of(0, 0);
  summary.convergence.iteration_count = 8;
  summary.convergence.last_max_displacement = 0.25;
  summary.convergence.tolerance = 0.5;
  const Tolerance absolute{.value = 0.5, .relative = false};

  EXPECT_THAT(
      report_of(summary, {.method = Optimize{}, .tolerance = {.value = 0.0625}}),
      HasSubstr("converged after 8 iterations (largest move 0.25, energy tolerance 0.0625)"));
  EXPECT_THAT(report_of(summary, {.method = Optimize{}, .tolerance = absolute}),
              HasSubstr("converged after 8 iterations (largest move 0.25, tolerance 0.5)"));
  summary.stop_reason = StopReason::target_reached;
  EXPECT_THAT(report_of(summary, {.method = Optimize{}}),
              HasSubstr("reached the target quality after 8 iterations\n"));
}

TEST(DescribeSummary, DrawsTheMeanRatiosBeforeAndAfter) {
  SmoothSummary summary;
  summary.quality_before = measure_quality(test::inverted(test::tet_ball()));
  summary.quality_after = measure_quality(test::tet_ball());

  const std::string text = report_of(summary, {.method = SmartLaplacian{}});

  for (const auto& [label, stats] : {std::pair{"before  ", &summary.quality_before},
                                     std::pair{"after   ", &summary.quality_after}}) {
    EXPECT_THAT(text, HasSubstr(std::string(label) + "-1 |" +
                                draw_histogram(stats->metrics[0].histogram) + "| 1\n"));
  }
}

TEST(DescribeSummary, SetsTheVolumeOfTheElementsAgainstTheEnclosedOne) {
  SmoothSummary summary;
  summary.quality_after.sum_absolute_volume = 1.25;
  summary.quality_after.enclosed_volume = 1;
  EXPECT_THAT(
      report_of(summary, {.method = SmartLaplacian{}}),
      HasSubstr("volume: the elements fill 1.25, the boundary encloses 1 (2.5e-01 more)\n"));

  SmoothSummary surface;
  surface.quality_after = measure_quality(test::lattice(ElementType::triangle, 2));
  EXPECT_THAT(report_of(surface, {.method = SmartLaplacian{}}), Not(HasSubstr("volume")));
}

TEST(DescribeSummary, SaysHowFarNodesOfCurvedPartsLieOffTheirBoundary) {
  SmoothSummary summary = summary_of(0, 0);
  summary.nodes.sliding_on_surface = 1234;
  summary.nodes.sliding_on_curve = 56;
  const SmoothOptions options{.method = SmartLaplacian{}, .boundary = BoundaryPolicy::slide};
  EXPECT_THAT(report_of(summary, options), Not(HasSubstr("curved parts:")));
  summary.deviation = {.tolerance = 5e-13, .result_to_input = 2e-16, .input_to_result = 0.0125};
  summary.quality_before.enclosed_volume = 4;
  summary.quality_after.enclosed_volume = 3.9;

  const std::string text = report_of(summary, options);

  EXPECT_THAT(text, HasSubstr(", 1,234 on their curved part and 56 along their curve"));
  EXPECT_THAT(text, HasSubstr("curved parts: nodes lie within 2.0e-16 of the facets of the input "
                              "(tolerance 5.0e-13); the new ones cut off up to 0.0125 and "
                              "changes the volume by -2.5 %\n"));
}

TEST(DescribeSummary, SaysWhatMayHaveHeldNodesBack) {
  SmoothSummary summary = summary_of(0, 0);
  summary.convergence.held_node_count = 3;

  EXPECT_THAT(report_of(summary, {.method = SmartLaplacian{}}),
              HasSubstr("; the guard held 3 back"));
  EXPECT_THAT(
      report_of(summary, {.method = SmartLaplacian{}, .movement_limit = MovementLimit{.value = 1}}),
      HasSubstr("; the guard or the movement limit held 3 back"));
}

TEST(DescribeSummary, SaysWhatIsLeftAndWhatHoldsPoorElements) {
  SmoothSummary summary = summary_of(0, 0);
  summary.convergence.remaining_gain = 0.0025;
  summary.poor = {.below = 0.2, .element_count = 1500, .locked_count = 3, .limited_count = 1490};
  EXPECT_THAT(report_of(summary, {}), HasSubstr(", about 0.25 % of the energy left to gain"));
  EXPECT_THAT(report_of(summary, {}),
              HasSubstr("1,500 elements below a mean ratio of 0.2: 3 locked, 1,490 limited by "
                        "connectivity, 7 could still become better\n"));
  summary.stop_reason = StopReason::stagnated;
  summary.convergence.end_rule = EndRule::all_held;
  EXPECT_THAT(report_of(summary, {}), HasSubstr("every move was rejected"));
}

TEST(DescribeQuality, ShowsEveryMetricWithItsHistogramAndTheWorstElements) {
  const QualityStats stats = measure_quality(test::inverted(test::tet_ball()));

  const std::string text = describe_quality(stats, [](std::int64_t id) { return id + 100; });

  for (const MetricStats& metric : stats.metrics) {
    std::string name(metric_name(metric.metric));
    std::ranges::replace(name, '_', ' ');
    EXPECT_THAT(text, HasSubstr(metric.element_count > 0 ? name : "")) << name;
  }
  EXPECT_THAT(text, HasSubstr("8 elements"));
  EXPECT_THAT(text, HasSubstr("inverted 0 (0.0 %), degenerate 0 (0.0 %)"));
  EXPECT_THAT(text,
              HasSubstr("8 elements are numbered the other way round and read as if they were "
                        "not: 100, 101, 102, 103, 104, 105, 106, 107\n"));
  EXPECT_THAT(text, HasSubstr("tetrahedron"));
  EXPECT_THAT(text, HasSubstr("10" + std::to_string(stats.worst[0].element)));
}

TEST(Readable, PutsCommasBetweenThousands) {
  EXPECT_EQ(with_commas(0), "0");
  EXPECT_EQ(with_commas(999), "999");
  EXPECT_EQ(with_commas(1000), "1,000");
  EXPECT_EQ(with_commas(-123456), "-123,456");
  EXPECT_EQ(with_commas(1234567), "1,234,567");
}

TEST(Readable, NeverRoundsAShareToNothingOrAll) {
  EXPECT_EQ(percentage(0, 10), "0.0 %");
  EXPECT_EQ(percentage(1, 100000), "< 0.1 %");
  EXPECT_EQ(percentage(99999, 100000), "> 99.9 %");
  EXPECT_EQ(percentage(10, 10), "100.0 %");
  EXPECT_EQ(percentage(0, 0), "0.0 %");
}

TEST(Readable, GivesDurationsTheirUnit) {
  EXPECT_EQ(duration(0.00035), "350 us");
  EXPECT_EQ(duration(0.0123), "12.3 ms");
  EXPECT_EQ(duration(1.92), "1.92 s");
  EXPECT_EQ(duration(723), "12 min 03 s");
}

}  // namespace
}  // namespace meshsmooth::cli
