#include <thrust/execution_policy.h>
#include <thrust/iterator/constant_iterator.h>
#include <thrust/iterator/transform_iterator.h>
#include <thrust/reduce.h>
#include <thrust/scan.h>
#include <thrust/scatter.h>
#include <thrust/sort.h>
#include <thrust/transform.h>
#include <thrust/unique.h>

#include "paper/steps.hpp"

namespace meshsmooth::bench {
namespace {

constexpr unsigned kThreads = 256;

unsigned blocks_for(std::size_t count) {
  return static_cast<unsigned>((count + kThreads - 1) / kThreads);
}

__device__ std::size_t thread_index() {
  return static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
}

/// Gives Thrust its temporary memory from a heap.
struct ThrustAllocator {
  using value_type = char;
  DeviceHeap* heap;

  char* allocate(std::ptrdiff_t bytes) {
    return static_cast<char*>(heap->allocate(static_cast<std::size_t>(bytes)));
  }
  void deallocate(char* data, std::size_t) { heap->release(data); }
};

struct DirectedEdge {
  NodeId from, to;
};

struct EdgeLess {
  __device__ bool operator()(const DirectedEdge& a, const DirectedEdge& b) const {
    return a.from != b.from ? a.from < b.from : a.to < b.to;
  }
};

struct EdgeEqual {
  __device__ bool operator()(const DirectedEdge& a, const DirectedEdge& b) const {
    return a.from == b.from && a.to == b.to;
  }
};

struct FromOf {
  __host__ __device__ NodeId operator()(const DirectedEdge& edge) const { return edge.from; }
};

struct ToOf {
  __host__ __device__ NodeId operator()(const DirectedEdge& edge) const { return edge.to; }
};

struct Face {
  NodeId a, b, c;  // ascending
};

struct FaceLess {
  __device__ bool operator()(const Face& p, const Face& q) const {
    if (p.a != q.a) return p.a < q.a;
    return p.b != q.b ? p.b < q.b : p.c < q.c;
  }
};

__device__ bool same(const Face& p, const Face& q) {
  return p.a == q.a && p.b == q.b && p.c == q.c;
}

__global__ void list_edges(const NodeId* tetrahedra, std::size_t count, DirectedEdge* edges) {
  const std::size_t t = thread_index();
  if (t >= count) return;
  const NodeId* const corner = tetrahedra + 4 * t;
  DirectedEdge* edge = edges + 12 * t;
  for (int from = 0; from < 4; ++from) {
    for (int to = 0; to < 4; ++to) {
      if (from != to) *edge++ = {corner[from], corner[to]};
    }
  }
}

__device__ Face sorted(NodeId a, NodeId b, NodeId c) {
  const NodeId low = min(a, min(b, c));
  const NodeId high = max(a, max(b, c));
  return {low, a ^ b ^ c ^ low ^ high, high};
}

__global__ void list_faces(const NodeId* tetrahedra, std::size_t count, Face* faces) {
  const std::size_t t = thread_index();
  if (t >= count) return;
  const NodeId* const n = tetrahedra + 4 * t;
  faces[4 * t] = sorted(n[1], n[2], n[3]);
  faces[4 * t + 1] = sorted(n[0], n[2], n[3]);
  faces[4 * t + 2] = sorted(n[0], n[1], n[3]);
  faces[4 * t + 3] = sorted(n[0], n[1], n[2]);
}

/// Threads that meet at a node all write the same.
__global__ void mark_faces_used_once(const Face* faces, std::size_t count, std::uint8_t* boundary) {
  const std::size_t f = thread_index();
  if (f >= count) return;
  const Face face = faces[f];
  if ((f > 0 && same(face, faces[f - 1])) || (f + 1 < count && same(face, faces[f + 1]))) return;
  boundary[face.a] = 1;
  boundary[face.b] = 1;
  boundary[face.c] = 1;
}

}  // namespace

void find_neighbours(DeviceHeap& heap, const NodeId* tetrahedra, std::size_t tetrahedron_count,
                     std::size_t node_count, DeviceTopology& topology) {
  ThrustAllocator allocator{&heap};
  const auto policy = thrust::cuda::par(allocator).on(heap.stream());

  DeviceArray<DirectedEdge> edges(heap, 12 * tetrahedron_count);
  list_edges<<<blocks_for(tetrahedron_count), kThreads, 0, heap.stream()>>>(
      tetrahedra, tetrahedron_count, edges.data());
  check_cuda(cudaGetLastError(), "listing edges");
  thrust::sort(policy, edges.data(), edges.data() + edges.size(), EdgeLess{});
  DirectedEdge* const end =
      thrust::unique(policy, edges.data(), edges.data() + edges.size(), EdgeEqual{});
  const auto entry_count = static_cast<std::size_t>(end - edges.data());

  DeviceArray<NodeId> nodes(heap, node_count);
  DeviceArray<std::int32_t> counts(heap, node_count);
  const auto from = thrust::make_transform_iterator(edges.data(), FromOf{});
  const auto counted = thrust::reduce_by_key(
      policy, from, from + static_cast<std::ptrdiff_t>(entry_count),
      thrust::make_constant_iterator(std::int32_t{1}), nodes.data(), counts.data());

  topology.node_count = node_count;
  topology.entry_count = entry_count;
  topology.starts = DeviceArray<std::int32_t>(heap, node_count + 1);
  std::int32_t* const starts = topology.starts.data();
  // A node in no tetrahedron is no key: its count stays 0.
  check_cuda(cudaMemsetAsync(starts, 0, topology.starts.bytes(), heap.stream()), "clearing counts");
  thrust::scatter(policy, counts.data(), counted.second, nodes.data(), starts);
  thrust::exclusive_scan(policy, starts, starts + node_count + 1, starts);

  topology.entries = DeviceArray<NodeId>(heap, entry_count);
  thrust::transform(policy, edges.data(), end, topology.entries.data(), ToOf{});
}

void find_boundary(DeviceHeap& heap, const NodeId* tetrahedra, std::size_t tetrahedron_count,
                   std::size_t node_count, DeviceTopology& topology) {
  ThrustAllocator allocator{&heap};
  const auto policy = thrust::cuda::par(allocator).on(heap.stream());

  DeviceArray<Face> faces(heap, 4 * tetrahedron_count);
  list_faces<<<blocks_for(tetrahedron_count), kThreads, 0, heap.stream()>>>(
      tetrahedra, tetrahedron_count, faces.data());
  check_cuda(cudaGetLastError(), "listing faces");
  thrust::sort(policy, faces.data(), faces.data() + faces.size(), FaceLess{});

  topology.boundary = DeviceArray<std::uint8_t>(heap, node_count);
  check_cuda(cudaMemsetAsync(topology.boundary.data(), 0, node_count, heap.stream()),
             "clearing the boundary");
  mark_faces_used_once<<<blocks_for(faces.size()), kThreads, 0, heap.stream()>>>(
      faces.data(), faces.size(), topology.boundary.data());
  check_cuda(cudaGetLastError(), "marking the boundary");
}

}  // namespace meshsmooth::bench
