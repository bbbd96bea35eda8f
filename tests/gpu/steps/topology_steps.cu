#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/device_session.cuh"
#include "smooth/cuda/backend.cuh"
#include "smooth/cuda/topology/landmarks.cuh"

namespace meshsmooth::test {
namespace {

using detail::CudaExecutor;

template <class Real>
DeviceOrder order_nodes(const std::vector<Vec3<Real>>& positions) {
  DeviceSession device;
  CudaExecutor& executor = device.executor;
  const std::size_t count = positions.size();
  const auto given = uploaded(executor, positions);
  auto caller_ids = executor.allocate<NodeId>(count);
  auto internal_of = executor.allocate<NodeId>(count);
  auto ordered = executor.allocate<Vec3<Real>>(count);
  auto fixed = executor.allocate<std::uint8_t>(count);
  auto ball_sizes = executor.allocate<std::uint32_t>(count + 1);
  auto state = executor.allocate<detail::PrepareState>(1);
  executor.clear(state.data(), 1);

  detail::order_nodes(
      executor,
      detail::NodeOrder<Real>{count, given.data(), caller_ids.data(), internal_of.data(),
                              ordered.data(), fixed.data(), ball_sizes.data()},
      state.data());

  const auto seen = downloaded(executor, state.data(), 1).front();
  const detail::Box box = detail::box_of(seen);
  return {downloaded(executor, caller_ids.data(), count),
          downloaded(executor, internal_of.data(), count),
          positions_as<double>(downloaded(executor, ordered.data(), count)),
          box.lower,
          box.upper,
          seen.wrong_position != 0};
}

/// Device rows by the caller's ids.
template <class Out, class Id, class CallerIdOf>
std::vector<std::vector<Out>> lists(CudaExecutor& executor, const std::vector<NodeId>& nodes,
                                    const detail::Rows<Id>& rows, const CallerIdOf& caller_id_of) {
  const auto offsets = downloaded(executor, rows.offsets, nodes.size() + 1);
  const auto entries = downloaded(executor, rows.entries, static_cast<std::size_t>(offsets.back()));
  std::vector<std::vector<Out>> result(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    auto& list = result[static_cast<std::size_t>(nodes[n])];
    for (std::int64_t k = offsets[n]; k < offsets[n + 1]; ++k) {
      list.push_back(caller_id_of(entries[static_cast<std::size_t>(k)]));
    }
  }
  return result;
}

template <class Real>
DeviceTopology prepare(const Mesh& mesh, const std::vector<Vec3<Real>>& positions,
                       const SmoothOptions& options) {
  DeviceSession device;
  CudaExecutor& executor = device.executor;
  const MeshTopology topology(mesh);
  const TopologyView view = topology.view();
  detail::CudaBackend backend(executor, view, mesh.positions_view(), QualityDetail::full);
  StageTimes times;
  const auto job = backend.prepare(view, std::span<const Vec3<Real>>(positions),
                                   detail::plan_job(options), device.control, times);

  const auto nodes = downloaded(executor, job.caller_ids.data(), job.node_count);
  DeviceTopology found;
  found.rings = lists<NodeId>(executor, nodes, job.rings.view(),
                              [&](NodeId id) { return nodes[static_cast<std::size_t>(id)]; });
  if (job.balls.offsets.size() != 0) {
    const auto elements =
        downloaded(executor, job.elements.caller_ids.data(), job.elements.caller_ids.size());
    found.balls = lists<std::int64_t>(
        executor, nodes, job.balls.view(), [&](detail::ElementId id) -> std::int64_t {
          return elements.empty() ? id : elements[id];  // empty: they are the caller's
        });
  }
  const auto fixed = downloaded(executor, job.fixed.data(), job.node_count);
  found.fixed.resize(job.node_count);
  for (std::size_t n = 0; n < job.node_count; ++n) {
    found.fixed[static_cast<std::size_t>(nodes[n])] = fixed[n] != 0;
  }
  found.nodes = job.nodes;
  found.free_count = job.free_count;
  found.lower = job.box.lower;
  found.upper = job.box.upper;
  executor.finish();
  return found;
}

}  // namespace

DeviceOrder order_nodes_on_device(const Mesh& mesh) {
  return std::visit([](const auto& positions) { return order_nodes(positions); }, mesh.positions);
}

DeviceLandmarks place_by_edges_on_device(const std::vector<std::vector<NodeId>>& rings) {
  DeviceSession device;
  CudaExecutor& executor = device.executor;
  const std::size_t count = rings.size();
  std::vector<std::int64_t> offsets = {0};
  std::vector<NodeId> entries;
  for (const auto& ring : rings) {
    entries.insert(entries.end(), ring.begin(), ring.end());
    offsets.push_back(static_cast<std::int64_t>(entries.size()));
  }
  const auto there_offsets = uploaded(executor, offsets);
  const auto there_entries = uploaded(executor, entries);
  const detail::Rows<NodeId> rows{there_offsets.data(), there_entries.data()};
  auto places = executor.allocate<Vec3f>(count);

  const detail::Landmarks landmarks = detail::find_landmarks(executor, count, rows);
  detail::place_by_edges(executor, count, rows, places.data());

  DeviceLandmarks found;
  found.nodes.assign(std::begin(landmarks.nodes), std::end(landmarks.nodes));
  const auto steps = downloaded(executor, landmarks.steps.data(), landmarks.steps.size());
  found.steps.assign(found.nodes.size(), std::vector<int>(count));
  for (std::size_t k = 0; k < steps.size(); ++k) {
    found.steps[k / count][k % count] = steps[k] == detail::Landmarks::kUnreached ? -1 : steps[k];
  }
  found.places = positions_as<double>(downloaded(executor, places.data(), count));
  return found;
}

DeviceTopology prepare_on_device(const Mesh& mesh, const SmoothOptions& options) {
  return std::visit([&](const auto& positions) { return prepare(mesh, positions, options); },
                    mesh.positions);
}

std::vector<std::vector<NodeId>> colour_on_device(const FlatMesh& mesh) {
  DeviceSession device;
  CudaExecutor& executor = device.executor;
  const OnDevice<double> there(executor, mesh, device.lane.shapes());
  const TopologyView none;
  const auto colouring = detail::CudaBackend(executor, none, {}, QualityDetail::full)
                             .colour(there.around, there.caller_ids.data());
  std::vector<std::vector<NodeId>> colours;
  for (std::size_t c = 0; c < colouring.count(); ++c) {
    colours.push_back(downloaded(executor, colouring.nodes.data() + colouring.first[c],
                                 colouring.first[c + 1] - colouring.first[c]));
  }
  return colours;
}

}  // namespace meshsmooth::test
