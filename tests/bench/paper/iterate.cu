#include "paper/steps.hpp"

namespace meshsmooth::bench {
namespace {

constexpr int kThreads = 1024;

struct Aos {
  float3* places;
  Aos(float* data, int) : places(reinterpret_cast<float3*>(data)) {}
  __device__ float3 load(int node) const { return places[node]; }
  __device__ void store(int node, float3 place) const { places[node] = place; }
};

struct AosAligned {
  float4* places;
  AosAligned(float* data, int) : places(reinterpret_cast<float4*>(data)) {}
  __device__ float3 load(int node) const {
    const float4 place = places[node];
    return {place.x, place.y, place.z};
  }
  __device__ void store(int node, float3 place) const {
    places[node] = {place.x, place.y, place.z, 0};
  }
};

struct Soa {
  float *x, *y, *z;
  Soa(float* data, int node_count)
      : x(data), y(data + node_count), z(data + 2 * static_cast<std::size_t>(node_count)) {}
  __device__ float3 load(int node) const { return {x[node], y[node], z[node]}; }
  __device__ void store(int node, float3 place) const {
    x[node] = place.x;
    y[node] = place.y;
    z[node] = place.z;
  }
};

struct Topology {
  int node_count;
  const std::int32_t* starts;
  const NodeId* entries;
  const std::uint8_t* boundary;
};

/// Moves one node; whether it moved farther than the tolerance.
template <class Places>
__device__ bool move_node(const Topology& mesh, int node, const Places& from, const Places& to,
                          float tolerance_squared) {
  const int begin = mesh.starts[node];
  const int end = mesh.starts[node + 1];
  if (mesh.boundary[node] != 0 || begin == end) return false;
  float3 sum = {0, 0, 0};
  for (int e = begin; e < end; ++e) {
    const float3 place = from.load(mesh.entries[e]);
    sum.x += place.x;
    sum.y += place.y;
    sum.z += place.z;
  }
  const auto degree = static_cast<float>(end - begin);
  const float3 old = from.load(node);
  const float3 place = {sum.x / degree, sum.y / degree, sum.z / degree};
  to.store(node, place);
  const float dx = place.x - old.x, dy = place.y - old.y, dz = place.z - old.z;
  return dx * dx + dy * dy + dz * dz > tolerance_squared;
}

// With more than one block these kernels race, as the paper's do: the blocks
// write the same nodes without any order. What comes out is not repeatable.

template <class Places>
__global__ void __launch_bounds__(kThreads)
    iterate_form_a(Topology mesh, Places from, Places to, float tolerance_squared, int most_sweeps,
                   std::int32_t* sweeps) {
  int count = 0;
  bool any_moved = true;
  while (any_moved && count < most_sweeps) {
    bool moved = false;
    for (int node = static_cast<int>(threadIdx.x); node < mesh.node_count; node += kThreads) {
      moved |= move_node(mesh, node, from, to, tolerance_squared);
    }
    const Places read = from;
    from = to;
    to = read;
    ++count;
    any_moved = __syncthreads_or(moved) != 0;
  }
  if (threadIdx.x == 0) sweeps[blockIdx.x] = count;
}

template <class Places>
__global__ void __launch_bounds__(kThreads)
    iterate_form_b(Topology mesh, Places places, float tolerance_squared, int most_sweeps,
                   std::int32_t* sweeps) {
  int count = 0;
  bool any_moved = true;
  while (any_moved && count < most_sweeps) {
    bool moved = false;
    for (int node = static_cast<int>(threadIdx.x); node < mesh.node_count; node += kThreads) {
      moved |= move_node(mesh, node, places, places, tolerance_squared);
    }
    ++count;
    any_moved = __syncthreads_or(moved) != 0;
  }
  if (threadIdx.x == 0) sweeps[blockIdx.x] = count;
}

/// After an odd number of sweeps form A's newest positions are in the second
/// array.
__global__ void take_second_if_odd(const std::int32_t* sweeps, float* first, const float* second,
                                   std::size_t count) {
  if (sweeps[0] % 2 == 0) return;
  const std::size_t i = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < count) first[i] = second[i];
}

template <class Places>
void iterate_in(DeviceHeap& heap, const DeviceTopology& topology, const Variant& variant,
                DeviceArray<float>& positions, float tolerance, int most_sweeps,
                DeviceArray<std::int32_t>& sweeps) {
  const Topology mesh = {static_cast<int>(topology.node_count), topology.starts.data(),
                         topology.entries.data(), topology.boundary.data()};
  const Places places(positions.data(), mesh.node_count);
  const float squared = tolerance * tolerance;
  const auto blocks = static_cast<unsigned>(variant.block_count);
  if (variant.form == IterationForm::b) {
    iterate_form_b<<<blocks, kThreads, 0, heap.stream()>>>(mesh, places, squared, most_sweeps,
                                                           sweeps.data());
    check_cuda(cudaGetLastError(), "iterating in form B");
    return;
  }
  DeviceArray<float> second(heap, positions.size());
  second.copy(positions);
  iterate_form_a<<<blocks, kThreads, 0, heap.stream()>>>(
      mesh, places, Places(second.data(), mesh.node_count), squared, most_sweeps, sweeps.data());
  check_cuda(cudaGetLastError(), "iterating in form A");
  const auto copy_blocks = static_cast<unsigned>((positions.size() + kThreads - 1) / kThreads);
  take_second_if_odd<<<copy_blocks, kThreads, 0, heap.stream()>>>(sweeps.data(), positions.data(),
                                                                  second.data(), positions.size());
  check_cuda(cudaGetLastError(), "taking the newest positions");
}

}  // namespace

void iterate(DeviceHeap& heap, const DeviceTopology& topology, const Variant& variant,
             DeviceArray<float>& positions, float tolerance, int most_sweeps,
             DeviceArray<std::int32_t>& sweeps) {
  switch (variant.layout) {
    case Layout::aos:
      iterate_in<Aos>(heap, topology, variant, positions, tolerance, most_sweeps, sweeps);
      break;
    case Layout::aos_aligned:
      iterate_in<AosAligned>(heap, topology, variant, positions, tolerance, most_sweeps, sweeps);
      break;
    case Layout::soa:
      iterate_in<Soa>(heap, topology, variant, positions, tolerance, most_sweeps, sweeps);
      break;
  }
}

}  // namespace meshsmooth::bench
