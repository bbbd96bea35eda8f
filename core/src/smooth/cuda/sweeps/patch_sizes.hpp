#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "meshsmooth/annotations.hpp"

namespace meshsmooth::detail {

/// What a device has for meshes that stay in its shared memories.
struct PatchLimits {
  int multiprocessors = 0;
  std::size_t shared_bytes = 0;  // of a block
};

/// How a mesh is cut into patches, one for each block of `resident_kernel`, and what
/// such a block has room for.
struct PatchSizes {
  int nodes = 0;    // that it moves, a multiple of 32
  int halo = 0;     // others that their rings name
  int entries = 0;  // of the rings, with what fills them up

  static constexpr int kPlaceBuffers = 3;
  static constexpr std::size_t kPlaceBytes = 16;

  /// Own nodes, halo, and one place of 0.
  [[nodiscard]] MESHSMOOTH_HD int places() const { return nodes + halo + 1; }
  [[nodiscard]] MESHSMOOTH_HD int slices() const { return nodes / 32; }
  [[nodiscard]] MESHSMOOTH_HD std::size_t bytes() const {
    return static_cast<std::size_t>(places()) * kPlaceBuffers * kPlaceBytes  // positions
           + static_cast<std::size_t>(nodes) * 2 * sizeof(double)            // squared moves
           + static_cast<std::size_t>(entries) * sizeof(std::uint16_t) +
           static_cast<std::size_t>(halo) * sizeof(int)            // their nodes
           + static_cast<std::size_t>(slices()) * 2 * sizeof(int)  // where slices begin and end
           + static_cast<std::size_t>(nodes) * 2 * sizeof(int);    // movers, sizes of rings
  }
  [[nodiscard]] std::size_t patches(std::size_t node_count) const {
    return (node_count + static_cast<std::size_t>(nodes) - 1) / static_cast<std::size_t>(nodes);
  }

  /// Nothing when the mesh is too large, or the positions are not `float`. What is found
  /// still may not fit a mesh whose order is poor.
  static std::optional<PatchSizes> of(std::size_t node_count, std::size_t real_bytes,
                                      const PatchLimits& limits) {
    constexpr std::size_t kFewestNodes = 64, kGrain = 32;
    constexpr int kEntriesPerNode = 18;  // of random Delaunay meshes about 17 …
    constexpr int kMoreEntries = 2048;   // … and chance has its part in small ones
    if (real_bytes != sizeof(float)) return std::nullopt;
    const auto blocks = static_cast<std::size_t>(limits.multiprocessors);
    const std::size_t share = (node_count + blocks - 1) / blocks;
    const std::size_t nodes = std::max(kFewestNodes, (share + kGrain - 1) / kGrain * kGrain);
    if (nodes * kPlaceBuffers * kPlaceBytes > limits.shared_bytes) return std::nullopt;
    PatchSizes sizes;
    sizes.nodes = static_cast<int>(nodes);
    sizes.entries = sizes.nodes * kEntriesPerNode + kMoreEntries;
    const std::size_t without = sizes.bytes();
    constexpr std::size_t kBytesPerHalo = kPlaceBuffers * kPlaceBytes + sizeof(int);
    if (without > limits.shared_bytes) return std::nullopt;
    // A compact patch's surface is smaller than this; the curve's are not that compact.
    const std::size_t wanted = std::min<std::size_t>(8 * nodes, 2048);
    sizes.halo =
        static_cast<int>(std::min(wanted, (limits.shared_bytes - without) / kBytesPerHalo));
    if (sizes.halo < sizes.nodes) return std::nullopt;
    // A block begins with two words for every 32 nodes of the mesh, where positions will be.
    const std::size_t words = 2 * (node_count / 32 + 1);
    const auto places = static_cast<std::size_t>(sizes.places());
    if (words * sizeof(int) > places * kPlaceBuffers * kPlaceBytes) return std::nullopt;
    return sizes;
  }
};

}  // namespace meshsmooth::detail
