#include "gpu/steps/device_session.cuh"
#include "gpu/steps/optimize_phase.hpp"
#include "smooth/cuda/backend.cuh"

namespace meshsmooth::test {

PhaseResult optimize_on_device(const FlatMesh& mesh, bool float32, const PhaseRequest& request) {
  DeviceSession device;
  const TopologyView none;
  detail::CudaBackend backend(device.executor, none, {}, QualityDetail::full);
  const ElementShape* const shapes = device.lane.shapes();
  return float32 ? run_optimize_phase<float>(backend, device.control, mesh, shapes, request)
                 : run_optimize_phase<double>(backend, device.control, mesh, shapes, request);
}

std::vector<NodeId> opposite_nodes_on_device(const FlatMesh& mesh) {
  DeviceSession device;
  const OnDevice<double> there(device.executor, mesh, device.lane.shapes());
  const TopologyView none;
  const auto opposite = detail::CudaBackend(device.executor, none, {}, QualityDetail::full)
                            .find_opposite_nodes(there.around);
  return downloaded(device.executor, opposite.data(), opposite.size());
}

}  // namespace meshsmooth::test
