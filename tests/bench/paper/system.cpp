#include "paper/system.hpp"

#include <algorithm>
#include <chrono>

namespace meshsmooth::bench {

PaperSystem::PaperSystem(const BenchMesh& mesh, float tolerance, const Stream& stream)
    : positions_(mesh.float_positions()),
      tetrahedra_(mesh.tetrahedra.size()),
      output_(4 * mesh.node_count()),
      tolerance_(tolerance),
      stream_(stream) {
  std::copy(mesh.tetrahedra.begin(), mesh.tetrahedra.end(), tetrahedra_.data());
}

const PinnedArray<float>& PaperSystem::input(Layout layout) {
  PinnedArray<float>& packed = inputs_[static_cast<std::size_t>(layout)];
  if (packed.size() > 0) return packed;
  const std::size_t node_count = positions_.size();
  packed = PinnedArray<float>(floats_of(layout) * node_count);
  std::fill(packed.data(), packed.data() + packed.size(), 0.0F);
  for (std::size_t node = 0; node < node_count; ++node) {
    packed.data()[float_index(layout, node_count, node, 0)] = positions_[node].x;
    packed.data()[float_index(layout, node_count, node, 1)] = positions_[node].y;
    packed.data()[float_index(layout, node_count, node, 2)] = positions_[node].z;
  }
  return packed;
}

std::vector<Vec3f> PaperSystem::unpack(Layout layout) const {
  const std::size_t node_count = positions_.size();
  std::vector<Vec3f> result(node_count);
  for (std::size_t node = 0; node < node_count; ++node) {
    result[node] = {output_.data()[float_index(layout, node_count, node, 0)],
                    output_.data()[float_index(layout, node_count, node, 1)],
                    output_.data()[float_index(layout, node_count, node, 2)]};
  }
  return result;
}

void PaperSystem::read_sweeps(const DeviceArray<std::int32_t>& sweeps, SystemRun& run) const {
  std::vector<std::int32_t> counts(sweeps.size());
  sweeps.download(counts.data());
  stream_.synchronize();
  const auto [least, most] = std::minmax_element(counts.begin(), counts.end());
  run.least_sweeps = *least;
  run.most_sweeps = *most;
}

DeviceTopology PaperSystem::make_topology(DeviceHeap& heap, StageMilliseconds& times) {
  Event start, uploaded, neighbours_found, boundary_found;
  DeviceTopology topology;
  start.record(stream_);
  DeviceArray<NodeId> tetrahedra(heap, tetrahedra_.size());
  tetrahedra.upload(tetrahedra_.data());
  uploaded.record(stream_);
  find_neighbours(heap, tetrahedra.data(), tetrahedra.size() / 4, positions_.size(), topology);
  neighbours_found.record(stream_);
  find_boundary(heap, tetrahedra.data(), tetrahedra.size() / 4, positions_.size(), topology);
  boundary_found.record(stream_);
  times.upload = uploaded.milliseconds_since(start);
  times.neighbours = neighbours_found.milliseconds_since(uploaded);
  times.boundary = boundary_found.milliseconds_since(neighbours_found);
  return topology;
}

SystemRun PaperSystem::run(DeviceHeap& heap, const Variant& variant) {
  const PinnedArray<float>& packed = input(variant.layout);
  Event start, uploaded, neighbours_found, boundary_found, iterated, downloaded;
  stream_.synchronize();

  const auto begin = std::chrono::steady_clock::now();
  start.record(stream_);
  DeviceArray<NodeId> tetrahedra(heap, tetrahedra_.size());
  tetrahedra.upload(tetrahedra_.data());
  DeviceArray<float> positions(heap, packed.size());
  positions.upload(packed.data());
  uploaded.record(stream_);
  DeviceTopology topology;
  find_neighbours(heap, tetrahedra.data(), tetrahedra.size() / 4, positions_.size(), topology);
  neighbours_found.record(stream_);
  find_boundary(heap, tetrahedra.data(), tetrahedra.size() / 4, positions_.size(), topology);
  boundary_found.record(stream_);
  DeviceArray<std::int32_t> sweeps(heap, static_cast<std::size_t>(variant.block_count));
  iterate(heap, topology, variant, positions, tolerance_, kMostSweeps, sweeps);
  iterated.record(stream_);
  positions.download(output_.data());
  downloaded.record(stream_);
  stream_.synchronize();
  const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - begin;

  SystemRun result;
  result.times = {uploaded.milliseconds_since(start),
                  neighbours_found.milliseconds_since(uploaded),
                  boundary_found.milliseconds_since(neighbours_found),
                  iterated.milliseconds_since(boundary_found),
                  downloaded.milliseconds_since(iterated),
                  wall.count()};
  read_sweeps(sweeps, result);
  result.positions = unpack(variant.layout);
  return result;
}

SystemRun PaperSystem::run_sweeps(DeviceHeap& heap, const DeviceTopology& topology,
                                  const Variant& variant) {
  const PinnedArray<float>& packed = input(variant.layout);
  DeviceArray<float> positions(heap, packed.size());
  positions.upload(packed.data());
  DeviceArray<std::int32_t> sweeps(heap, static_cast<std::size_t>(variant.block_count));
  Event start, iterated;
  start.record(stream_);
  iterate(heap, topology, variant, positions, tolerance_, kMostSweeps, sweeps);
  iterated.record(stream_);
  positions.download(output_.data());
  SystemRun result;
  read_sweeps(sweeps, result);
  result.times.iterate = iterated.milliseconds_since(start);
  result.positions = unpack(variant.layout);
  return result;
}

HostTopology download_topology(const DeviceTopology& topology, const Stream& stream) {
  HostTopology host;
  host.rings.starts.resize(topology.starts.size());
  host.rings.entries.resize(topology.entries.size());
  host.boundary.resize(topology.boundary.size());
  topology.starts.download(host.rings.starts.data());
  topology.entries.download(host.rings.entries.data());
  topology.boundary.download(host.boundary.data());
  stream.synchronize();
  return host;
}

}  // namespace meshsmooth::bench
