#pragma once

#include <cstdint>

#include "gpu/cuda.hpp"
#include "meshsmooth/mesh.hpp"
#include "paper/variant.hpp"

/// The three steps of the paper on the GPU, all on the stream of the heap that
/// their memory comes from. Not the product's path, and shares nothing with it.
namespace meshsmooth::bench {

/// What the sweeps need to know of a mesh, on the device.
struct DeviceTopology {
  std::size_t node_count = 0;
  std::size_t entry_count = 0;
  DeviceArray<std::int32_t> starts;    // node_count + 1
  DeviceArray<NodeId> entries;         // at least entry_count
  DeviceArray<std::uint8_t> boundary;  // node_count, 1 on the boundary
};

/// Fills starts and entries: both directions of the six edges of every
/// tetrahedron, sorted (thrust::sort), made unique (thrust::unique) and counted
/// by their first node (thrust::reduce_by_key). Peak 192 B a tetrahedron beside
/// the result.
void find_neighbours(DeviceHeap& heap, const NodeId* tetrahedra, std::size_t tetrahedron_count,
                     std::size_t node_count, DeviceTopology& topology);

/// Fills boundary: the four faces of every tetrahedron, sorted (thrust::sort);
/// those that occur once mark their nodes.
void find_boundary(DeviceHeap& heap, const NodeId* tetrahedra, std::size_t tetrahedron_count,
                   std::size_t node_count, DeviceTopology& topology);

/// Sweeps until every block has seen a sweep of its own in which no node moved
/// farther than `tolerance`, or `most_sweeps`. Every block sweeps all nodes, and
/// no block waits for another. `positions` is in the variant's layout and holds
/// the result afterwards; of form A with many blocks, what block 0 wrote last.
/// `sweeps` receives the sweeps of each block.
void iterate(DeviceHeap& heap, const DeviceTopology& topology, const Variant& variant,
             DeviceArray<float>& positions, float tolerance, int most_sweeps,
             DeviceArray<std::int32_t>& sweeps);

}  // namespace meshsmooth::bench
