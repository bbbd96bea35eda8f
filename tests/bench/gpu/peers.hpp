#pragma once

#include <string>
#include <vector>

#include "gpu/cuda.hpp"
#include "paper/system.hpp"

namespace meshsmooth::bench {

/// A way to do one Jacobi sweep of float32 positions on the GPU, without a test
/// of convergence.
struct PeerSweep {
  std::string name;
  double microseconds = 0;
  /// To the serial algorithm after kCheckedSweeps.
  double largest_difference = 0;
  /// Why there is no time; empty where there is.
  std::string skipped;
};

/// What a peer works on and is compared by.
struct PeerInput {
  const HostTopology& topology;
  const std::vector<Vec3f>& positions;
  const std::vector<Vec3f>& expected;  // after kCheckedSweeps
  int repeats;
};

inline constexpr int kCheckedSweeps = 2;

/// Sweeps that are timed together; even, so that the result is where the input was.
[[nodiscard]] inline int timed_sweeps(std::size_t node_count) {
  return node_count > 4'000'000 ? 20 : 100;
}

/// A row-stochastic CSR matrix (a boundary node's row has its own 1) times three
/// dense columns: every order of the dense matrices and every algorithm.
/// libcusparse is opened at run time: MESHSMOOTH_CUSPARSE, else libcusparse.so.12.
/// Prints what it skips.
[[nodiscard]] std::vector<PeerSweep> measure_cusparse(const PeerInput& input);

/// As index_add_ of PyTorch does it: every directed edge adds a position to the
/// sum of a node by atomics, then the sums are divided.
[[nodiscard]] PeerSweep measure_scatter_add(const PeerInput& input);

/// Bytes read and written per second by a copy of 1 GiB on the device.
[[nodiscard]] double measure_copy_bandwidth();

}  // namespace meshsmooth::bench
