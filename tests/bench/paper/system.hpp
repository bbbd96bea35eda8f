#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "gpu/bench_mesh.hpp"
#include "gpu/cuda.hpp"
#include "paper/serial.hpp"
#include "paper/steps.hpp"

namespace meshsmooth::bench {

/// Milliseconds between CUDA events, in the order of the stages.
struct StageMilliseconds {
  double upload = 0;
  double neighbours = 0;
  double boundary = 0;
  double iterate = 0;
  double download = 0;
  /// From the call to the positions in host memory, by the host's clock.
  double wall = 0;
};

struct SystemRun {
  StageMilliseconds times;
  std::vector<Vec3f> positions;
  int least_sweeps = 0;  // of the quickest block
  int most_sweeps = 0;   // of the slowest block
};

/// The paper's whole system for one mesh: from connectivity and positions in
/// page-locked host memory, there already in the layout of the variant, to
/// positions in page-locked memory.
class PaperSystem {
 public:
  /// A block that has not converged after so many sweeps gives up.
  static constexpr int kMostSweeps = 500;

  PaperSystem(const BenchMesh& mesh, float tolerance, const Stream& stream);

  /// Everything from upload to download, with memory from `heap`.
  [[nodiscard]] SystemRun run(DeviceHeap& heap, const Variant& variant);

  /// The sweeps alone, on a topology made before; only `times.iterate` is set.
  [[nodiscard]] SystemRun run_sweeps(DeviceHeap& heap, const DeviceTopology& topology,
                                     const Variant& variant);

  /// Upload, neighbours and boundary, left on the device.
  [[nodiscard]] DeviceTopology make_topology(DeviceHeap& heap, StageMilliseconds& times);

 private:
  /// Positions of the mesh in a layout; made on first use.
  [[nodiscard]] const PinnedArray<float>& input(Layout layout);
  [[nodiscard]] std::vector<Vec3f> unpack(Layout layout) const;
  void read_sweeps(const DeviceArray<std::int32_t>& sweeps, SystemRun& run) const;

  std::vector<Vec3f> positions_;
  PinnedArray<NodeId> tetrahedra_;
  std::array<PinnedArray<float>, kLayouts.size()> inputs_;
  PinnedArray<float> output_;
  float tolerance_;
  const Stream& stream_;
};

/// Rings and boundary in host memory.
struct HostTopology {
  Rings rings;
  std::vector<std::uint8_t> boundary;
};
[[nodiscard]] HostTopology download_topology(const DeviceTopology& topology, const Stream& stream);

}  // namespace meshsmooth::bench
