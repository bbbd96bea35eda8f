#include "gpu/peers.hpp"
#include "gpu/sweep_timer.hpp"

namespace meshsmooth::bench {
namespace {

constexpr unsigned kThreads = 256;

unsigned blocks_for(std::size_t count) {
  return static_cast<unsigned>((count + kThreads - 1) / kThreads);
}

__device__ std::size_t thread_index() {
  return static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
}

__global__ void scatter_add(std::size_t edge_count, const NodeId* from, const NodeId* to,
                            const float3* places, float* sums) {
  const std::size_t edge = thread_index();
  if (edge >= edge_count) return;
  const float3 place = places[from[edge]];
  float* const sum = sums + 3 * static_cast<std::size_t>(to[edge]);
  atomicAdd(sum, place.x);
  atomicAdd(sum + 1, place.y);
  atomicAdd(sum + 2, place.z);
}

/// Divides the sums; a node that stays has degree 0 and takes its old place.
__global__ void divide(std::size_t node_count, const float* degrees, const float3* old,
                       float3* sums) {
  const std::size_t node = thread_index();
  if (node >= node_count) return;
  const float degree = degrees[node];
  if (degree == 0) {
    sums[node] = old[node];
    return;
  }
  const float3 sum = sums[node];
  sums[node] = {sum.x / degree, sum.y / degree, sum.z / degree};
}

/// The directed edges that end at nodes that move.
struct Edges {
  std::vector<NodeId> from, to;
  std::vector<float> degrees;
};

Edges list_edges(const HostTopology& topology) {
  Edges edges;
  for (std::size_t node = 0; node < topology.rings.node_count(); ++node) {
    const auto ring = topology.rings.of(node);
    const bool moves = topology.boundary[node] == 0;
    edges.degrees.push_back(moves ? static_cast<float>(ring.size()) : 0);
    if (!moves) continue;
    edges.from.insert(edges.from.end(), ring.begin(), ring.end());
    edges.to.insert(edges.to.end(), ring.size(), static_cast<NodeId>(node));
  }
  return edges;
}

template <class T>
DeviceArray<T> uploaded(DeviceHeap& heap, const std::vector<T>& values) {
  DeviceArray<T> array(heap, values.size());
  array.upload(values.data());
  return array;
}

}  // namespace

PeerSweep measure_scatter_add(const PeerInput& input) {
  static_assert(sizeof(Vec3f) == sizeof(float3));
  const std::size_t node_count = input.positions.size();
  const Stream stream;
  DeviceHeap heap(Memory::plain, stream);
  const Edges edges = list_edges(input.topology);
  const DeviceArray<NodeId> from = uploaded(heap, edges.from);
  const DeviceArray<NodeId> to = uploaded(heap, edges.to);
  const DeviceArray<float> degrees = uploaded(heap, edges.degrees);
  DeviceArray<Vec3f> first = uploaded(heap, input.positions);
  DeviceArray<Vec3f> second(heap, node_count);

  const auto sweep = [&](const DeviceArray<Vec3f>& old, DeviceArray<Vec3f>& next) {
    check_cuda(cudaMemsetAsync(next.data(), 0, next.bytes(), stream.get()), "clearing sums");
    scatter_add<<<blocks_for(from.size()), kThreads, 0, stream.get()>>>(
        from.size(), from.data(), to.data(), reinterpret_cast<const float3*>(old.data()),
        reinterpret_cast<float*>(next.data()));
    check_cuda(cudaGetLastError(), "adding positions");
    divide<<<blocks_for(node_count), kThreads, 0, stream.get()>>>(
        node_count, degrees.data(), reinterpret_cast<const float3*>(old.data()),
        reinterpret_cast<float3*>(next.data()));
    check_cuda(cudaGetLastError(), "dividing sums");
  };

  PeerSweep result;
  result.name = "scatter-add";
  static_assert(kCheckedSweeps == 2);
  sweep(first, second);
  sweep(second, first);
  std::vector<Vec3f> found(node_count);
  first.download(found.data());
  stream.synchronize();
  result.largest_difference = largest_difference(found, input.expected);

  const int sweeps = timed_sweeps(node_count);
  const double milliseconds = quickest_milliseconds(stream, input.repeats, [&] {
    for (int pair = 0; pair < sweeps / 2; ++pair) {
      sweep(first, second);
      sweep(second, first);
    }
  });
  result.microseconds = 1000 * milliseconds / sweeps;
  return result;
}

double measure_copy_bandwidth() {
  constexpr std::size_t kBytes = std::size_t{1} << 30;
  const Stream stream;
  DeviceHeap heap(Memory::plain, stream);
  DeviceArray<char> source(heap, kBytes);
  DeviceArray<char> target(heap, kBytes);
  check_cuda(cudaMemsetAsync(source.data(), 0, kBytes, stream.get()), "clearing memory");
  const double milliseconds = median_milliseconds(stream, 20, [&] { target.copy(source); });
  return 2.0 * static_cast<double>(kBytes) / (milliseconds * 1e-3);
}

}  // namespace meshsmooth::bench
