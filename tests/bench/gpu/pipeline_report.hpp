#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "gpu/device_info.hpp"
#include "gpu/lanes.hpp"
#include "gpu/optimize_figures.hpp"
#include "gpu/peers.hpp"
#include "gpu/product.hpp"
#include "paper/measure.hpp"

namespace meshsmooth::bench {

/// What was measured of one mesh; empty where it was not.
struct MeshFigures {
  std::string mesh;
  std::size_t node_count = 0;
  std::size_t tetrahedron_count = 0;
  std::optional<ProductFigures> product, product_double, cpu;
  std::optional<double> sweep_us, sweep_double_us, cpu_sweep_us;
  std::optional<PaperFigures> paper;
  std::optional<StageMilliseconds> paper_topology;
  std::size_t paper_peak_bytes = 0;
  double sweep_bytes = 0;
  double sweep_double_bytes = 0;
  std::vector<PeerSweep> cusparse;
  std::optional<PeerSweep> scatter;
  std::optional<OptimizeFigures> optimize;

  /// Null where none was measured.
  [[nodiscard]] const PeerSweep* best_cusparse() const;
};

/// Empty figures: the method failed.
struct MethodFigures {
  std::string name;
  std::optional<ProductFigures> figures;
};

/// Everything that `meshsmooth-bench pipeline` measures.
struct PipelineReport {
  DeviceInfo device;
  int repeats = 0;
  double copy_bandwidth = 0;  // bytes read and written per second
  std::vector<MeshFigures> meshes;
  int method_sweeps = 0;
  std::vector<MethodFigures> methods;
  std::vector<LaneFigures> lanes;
  std::vector<std::string> errors;
};

void print(std::ostream& out, const PipelineReport& report);
[[nodiscard]] Json to_json(const PipelineReport& report);

}  // namespace meshsmooth::bench
