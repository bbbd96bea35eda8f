#include "gpu/product.hpp"

#include <chrono>

namespace meshsmooth::bench {

SmoothOptions plain_options(double tolerance, int max_iterations) {
  SmoothOptions options;
  options.method = Laplacian{};
  options.form = Form::jacobi;
  options.max_iterations = max_iterations;
  options.tolerance = {tolerance, false};
  options.guard = false;
  options.never_worse = false;
  return options;
}

template <class Real>
ProductFigures measure_product(Smoother& smoother, const PinnedTopology& topology,
                               PinnedPositions<Real>& positions, const SmoothOptions& options,
                               int repeats, const PreparedTopology* prepared) {
  constexpr int kWarmUps = 2;
  const TopologyView view = topology.view();
  std::vector<double> wall, upload, neighbours, boundary, iterate, evaluate, download;
  ProductFigures figures;
  for (int run = -kWarmUps; run < repeats; ++run) {
    positions.restore();
    const auto begin = std::chrono::steady_clock::now();
    figures.summary = prepared != nullptr
                          ? smoother.smooth(*prepared, positions.span(), options, {})
                          : smoother.smooth(view, positions.span(), options, {});
    const std::chrono::duration<double, std::milli> elapsed =
        std::chrono::steady_clock::now() - begin;
    if (run < 0) continue;
    const StageTimes& times = figures.summary.times;
    wall.push_back(elapsed.count());
    upload.push_back(1e3 * times.upload_seconds);
    neighbours.push_back(1e3 * times.find_neighbours_seconds);
    boundary.push_back(1e3 * times.find_boundary_seconds);
    iterate.push_back(1e3 * times.iterate_seconds);
    evaluate.push_back(1e3 * times.evaluate_seconds);
    download.push_back(1e3 * times.download_seconds);
  }
  figures.wall_ms = median(wall);
  figures.upload_ms = median(upload);
  figures.neighbours_ms = median(neighbours);
  figures.boundary_ms = median(boundary);
  figures.iterate_ms = median(iterate);
  figures.evaluate_ms = median(evaluate);
  figures.download_ms = median(download);
  return figures;
}

template <class Real>
double sweep_microseconds(Smoother& smoother, const PinnedTopology& topology,
                          PinnedPositions<Real>& positions, int repeats) {
  constexpr int kFew = 20, kMany = 120;
  const ProductFigures few =
      measure_product(smoother, topology, positions, plain_options(0, kFew), repeats);
  const ProductFigures many =
      measure_product(smoother, topology, positions, plain_options(0, kMany), repeats);
  if (few.summary.convergence.iteration_count != kFew ||
      many.summary.convergence.iteration_count != kMany) {
    throw std::runtime_error("smooth() stopped before the sweeps that were asked for");
  }
  return 1e3 * (many.iterate_ms - few.iterate_ms) / (kMany - kFew);
}

template ProductFigures measure_product(Smoother&, const PinnedTopology&, PinnedPositions<float>&,
                                        const SmoothOptions&, int, const PreparedTopology*);
template ProductFigures measure_product(Smoother&, const PinnedTopology&, PinnedPositions<double>&,
                                        const SmoothOptions&, int, const PreparedTopology*);
template double sweep_microseconds(Smoother&, const PinnedTopology&, PinnedPositions<float>&, int);
template double sweep_microseconds(Smoother&, const PinnedTopology&, PinnedPositions<double>&, int);

Json to_json(const ProductFigures& figures) {
  const SmoothSummary& summary = figures.summary;
  Json json;
  json.set("wall_ms", figures.wall_ms)
      .set("upload_ms", figures.upload_ms)
      .set("neighbours_ms", figures.neighbours_ms)
      .set("boundary_ms", figures.boundary_ms)
      .set("iterate_ms", figures.iterate_ms)
      .set("evaluate_ms", figures.evaluate_ms)
      .set("download_ms", figures.download_ms)
      .set("backend", summary.backend)
      .set("sweeps", summary.convergence.iteration_count)
      .set("inverted_after", summary.quality_after.inverted_count)
      .set("device_peak_bytes", summary.device_peak_bytes)
      .set("host_peak_bytes", summary.host_peak_bytes);
  return json;
}

}  // namespace meshsmooth::bench
