#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "meshsmooth/annotations.hpp"
#include "smooth/cuda/base/lane.hpp"

namespace meshsmooth::detail {

/// How a mesh is cut into patches, one per block of `resident_kernel`, and the capacity of a
/// block.
struct PatchSizes {
  int nodes = 0;    // own, a multiple of 32
  int halo = 0;     // nodes of other patches in their rings
  int entries = 0;  // of the rings, padding included

  static constexpr int kBuffers = 3;
  static constexpr std::size_t kPositionBytes = 16;

  /// Own nodes, halo, and one position of 0.
  [[nodiscard]] MESHSMOOTH_HD int positions() const { return nodes + halo + 1; }
  [[nodiscard]] MESHSMOOTH_HD int slices() const { return nodes / 32; }
  [[nodiscard]] MESHSMOOTH_HD std::size_t bytes() const {
    return static_cast<std::size_t>(positions()) * kBuffers * kPositionBytes  // positions
           + static_cast<std::size_t>(nodes) * 2 * sizeof(double)             // squared moves
           + static_cast<std::size_t>(entries) * sizeof(std::uint16_t) +
           static_cast<std::size_t>(halo) * sizeof(int)            // their nodes
           + static_cast<std::size_t>(slices()) * 2 * sizeof(int)  // slices
           + static_cast<std::size_t>(nodes) * 2 * sizeof(int);    // free nodes, sizes of rings
  }
  [[nodiscard]] std::size_t patches(std::size_t node_count) const {
    return (node_count + static_cast<std::size_t>(nodes) - 1) / static_cast<std::size_t>(nodes);
  }

  /// Nothing if the mesh is too large, or the positions are not `float`. A mesh whose order has
  /// little locality may still not fit.
  static std::optional<PatchSizes> of(std::size_t node_count, std::size_t real_bytes,
                                      const DeviceLimits& limits) {
    constexpr std::size_t kFewestNodes = 64, kGrain = 32;
    constexpr int kEntriesPerNode = 18;  // of random Delaunay meshes about 17 …
    constexpr int kMoreEntries = 2048;   // … more by chance in small ones
    if (real_bytes != sizeof(float)) return std::nullopt;
    const auto blocks = static_cast<std::size_t>(limits.multiprocessors);
    const std::size_t share = (node_count + blocks - 1) / blocks;
    const std::size_t nodes = std::max(kFewestNodes, (share + kGrain - 1) / kGrain * kGrain);
    if (nodes * kBuffers * kPositionBytes > limits.shared_bytes) return std::nullopt;
    PatchSizes sizes;
    sizes.nodes = static_cast<int>(nodes);
    sizes.entries = sizes.nodes * kEntriesPerNode + kMoreEntries;
    const std::size_t without = sizes.bytes();
    constexpr std::size_t kBytesPerHalo = kBuffers * kPositionBytes + sizeof(int);
    if (without > limits.shared_bytes) return std::nullopt;
    // A compact patch would have less surface than those along the curve.
    const std::size_t wanted = std::min<std::size_t>(8 * nodes, 2048);
    sizes.halo =
        static_cast<int>(std::min(wanted, (limits.shared_bytes - without) / kBytesPerHalo));
    if (sizes.halo < sizes.nodes) return std::nullopt;
    // Set-up keeps two words per 32 nodes of the mesh where positions will be.
    const std::size_t words = 2 * (node_count / 32 + 1);
    const auto positions = static_cast<std::size_t>(sizes.positions());
    if (words * sizeof(int) > positions * kBuffers * kPositionBytes) return std::nullopt;
    return sizes;
  }
};

}  // namespace meshsmooth::detail
