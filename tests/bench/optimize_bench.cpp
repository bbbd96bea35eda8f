// The optimizer against the textbook's descent (tests/support/descent.hpp), both to within
// half a per cent of the converged mean of the mean ratios:
//   optimize_bench MESH [THREADS]

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "formats/mesh_file.hpp"
#include "meshsmooth/smoother.hpp"
#include "support/descent.hpp"

namespace {

using namespace meshsmooth;
using Clock = std::chrono::steady_clock;

double mean_of(const QualityStats& quality) {
  for (const MetricStats& stats : quality.metrics) {
    if (stats.metric == QualityMetric::mean_ratio) return stats.mean;
  }
  return 0;
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Run {
  double mean = 0;
  double seconds = 0;  // sweeps, and what they need beside rings and balls
  int sweeps = 0;
};

Run run_product(const Mesh& mesh, int threads, int sweeps, double tolerance) {
  Run best{.seconds = HUGE_VAL};
  const auto smoother = make_smoother("cpu", threads);
  for (int repeat = 0; repeat < 5; ++repeat) {
    Mesh copy = mesh;
    const SmoothSummary summary = smoother->smooth(
        copy, {.method = Optimize{}, .max_iterations = sweeps, .tolerance = {tolerance}});
    best.mean = mean_of(summary.quality_after);
    best.sweeps = summary.convergence.iteration_count;
    best.seconds = std::min(best.seconds, summary.times.iterate_seconds);
  }
  return best;
}

Run run_textbook(Mesh mesh, double goal) {
  test::oracle::Descent descent(mesh, 2);
  test::oracle::Points x = test::oracle::to_points(mesh);
  Run run;
  while (run.mean < goal && run.sweeps < 200) {
    const Clock::time_point start = Clock::now();
    descent.sweep(x);
    run.seconds += seconds_since(start);
    ++run.sweeps;
    for (std::size_t n = 0; n < x.size(); ++n) {
      test::points(mesh)[n] = {x[n].x(), x[n].y(), x[n].z()};
    }
    run.mean = mean_of(measure_quality(mesh));
  }
  return run;
}

void print(const char* name, const Run& run) {
  std::printf("%-24s %3d sweeps  mean ratio %.5f  %9.3f s\n", name, run.sweeps, run.mean,
              run.seconds);
}

int compare(const Mesh& mesh, int threads) {
  const Run converged = run_product(mesh, threads, 200, 1e-7);
  print("product, converged", converged);
  Run near;
  for (const double share : {0.995, 0.999}) {
    int sweeps = 1;
    Run run = run_product(mesh, threads, sweeps, 0);
    while (run.mean < share * converged.mean) run = run_product(mesh, threads, ++sweeps, 0);
    print(share < 0.999 ? "product, within 0.5 %" : "product, within 0.1 %", run);
    if (share < 0.999) near = run;
    std::printf("%24s %.1f million elements * sweeps / s\n", "",
                static_cast<double>(mesh.element_count()) * run.sweeps / run.seconds * 1e-6);
  }
  const Run textbook = run_textbook(mesh, 0.995 * converged.mean);
  print("textbook, within 0.5 %", textbook);
  std::printf("the product on %d threads is %.0f times as fast as the textbook\n", threads,
              textbook.seconds / near.seconds);
  return textbook.mean >= 0.995 * converged.mean ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: optimize_bench MESH [THREADS]\n");
    return 2;
  }
  try {
    return compare(formats::read_mesh_file(argv[1]).mesh, argc == 3 ? std::atoi(argv[2]) : 2);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "optimize_bench: %s\n", error.what());
    return 1;
  }
}
