#include "gpu/optimize_figures.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "generate/tangle.hpp"

namespace meshsmooth::bench {
namespace {

constexpr double kTangledShare = 0.4;
constexpr int kConvergedSweeps = 120;
constexpr int kMostSweeps = 30;

SmoothOptions sweeps_of_optimize(int sweeps) {
  SmoothOptions options;
  options.method = Optimize{};
  options.max_iterations = sweeps;
  options.tolerance = {0, true};
  return options;
}

const MetricStats& mean_ratio(const SmoothSummary& summary) {
  return summary.quality_after.metrics.front();
}

/// A mesh that is optimized again and again.
class Case {
 public:
  explicit Case(const BenchMesh& mesh) : topology_(mesh), positions_(mesh) {}

  SmoothSummary run(Smoother& smoother, int sweeps) {
    positions_.restore();
    return smoother.smooth(topology_.view(), positions_.span(), sweeps_of_optimize(sweeps), {});
  }

  /// The fewest sweeps after which `reached`.
  template <class Reached>
  int sweeps_until(Smoother& smoother, const Reached& reached) {
    for (int sweeps = 1; sweeps <= kMostSweeps; ++sweeps) {
      if (reached(run(smoother, sweeps))) return sweeps;
    }
    throw std::runtime_error("the goal is not reached in " + std::to_string(kMostSweeps) +
                             " sweeps");
  }

  /// `setting_up_ms`: what iterate takes before the sweeps; 0: found by a run of one sweep.
  OptimizeRun measure(Smoother& smoother, int sweeps, int repeats, double setting_up_ms = 0) {
    const auto timed = [&](int count) {
      return measure_product(smoother, topology_, positions_, sweeps_of_optimize(count), repeats);
    };
    OptimizeRun run;
    run.figures = timed(sweeps);
    if (setting_up_ms > 0) {
      run.sweeps_ms = run.figures.iterate_ms - setting_up_ms;
    } else if (sweeps > 1) {
      run.sweeps_ms = (run.figures.iterate_ms - timed(1).iterate_ms) * sweeps / (sweeps - 1);
    }
    run.inverted_before = run.figures.summary.quality_before.inverted_count;
    run.mean_ratio = mean_ratio(run.figures.summary).mean;
    run.worst_ratio = mean_ratio(run.figures.summary).min;
    return run;
  }

  /// The largest difference of a quality figure.
  double difference(Smoother& other, const SmoothSummary& summary) {
    const SmoothSummary theirs = run(other, summary.convergence.iteration_count);
    double largest = 0;
    for (std::size_t k = 0; k < summary.quality_after.metrics.size(); ++k) {
      const MetricStats& a = summary.quality_after.metrics[k];
      const MetricStats& b = theirs.quality_after.metrics[k];
      for (const double d : {a.min - b.min, a.mean - b.mean, a.percentile_1 - b.percentile_1}) {
        largest = std::max(largest, std::abs(d));
      }
    }
    return largest;
  }

 private:
  PinnedTopology topology_;
  PinnedPositions<float> positions_;
};

BenchMesh tangled(const BenchMesh& mesh) {
  const auto inside = [](double c) { return c > 0 && c < 1; };
  std::vector<std::uint8_t> movable;
  movable.reserve(mesh.node_count());
  for (const Vec3d& p : mesh.positions)
    movable.push_back(inside(p.x) && inside(p.y) && inside(p.z));
  Mesh thrown;
  thrown.positions = mesh.positions;
  thrown.blocks.push_back({ElementType::tetrahedron, mesh.tetrahedra});
  formats::tangle(thrown, movable, kTangledShare, 1);
  return {mesh.name + " tangled", std::get<std::vector<Vec3d>>(thrown.positions), mesh.tetrahedra};
}

Json to_json(const OptimizeRun& run) {
  Json json;
  return json.set("figures", to_json(run.figures))
      .set("sweeps_ms", run.sweeps_ms)
      .set("inverted_before", run.inverted_before)
      .set("mean_ratio_mean", run.mean_ratio)
      .set("mean_ratio_worst", run.worst_ratio);
}

}  // namespace

OptimizeFigures measure_optimize(const BenchMesh& mesh, int repeats) {
  const auto cuda = make_smoother("cuda");
  const auto cpu = make_smoother("cpu");
  OptimizeFigures figures;
  {
    Case valid(mesh);
    figures.converged_mean = mean_ratio(valid.run(*cuda, kConvergedSweeps)).mean;
    const int sweeps = valid.sweeps_until(*cuda, [&](const SmoothSummary& summary) {
      return mean_ratio(summary).mean > 0.999 * figures.converged_mean;
    });
    figures.to_converged = valid.measure(*cuda, sweeps, repeats);
    figures.cpu_difference = valid.difference(*cpu, figures.to_converged.figures.summary);
  }
  Case thrown(tangled(mesh));
  const int sweeps = thrown.sweeps_until(*cuda, [](const SmoothSummary& summary) {
    return summary.quality_after.inverted_count == 0;
  });
  const OptimizeRun& valid = figures.to_converged;
  figures.to_untangled =
      thrown.measure(*cuda, sweeps, repeats, valid.figures.iterate_ms - valid.sweeps_ms);
  return figures;
}

Json to_json(const OptimizeFigures& figures) {
  Json json;
  json.set("converged_mean_ratio", figures.converged_mean)
      .set("to_converged", to_json(figures.to_converged))
      .set("to_untangled", to_json(figures.to_untangled));
  if (figures.cpu_difference) json.set("largest_difference_from_cpu", *figures.cpu_difference);
  return json;
}

}  // namespace meshsmooth::bench
