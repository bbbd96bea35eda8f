#include "gpu/steps/device_session.cuh"
#include "gpu/steps/optimize_phase.hpp"
#include "smooth/cuda/sweeps/cuda_optimize.hpp"

namespace meshsmooth::test {

PhaseResult optimize_on_device(const FlatMesh& mesh, bool float32, const PhaseRequest& request) {
  DeviceSession device;
  const auto run = [&]<class Real>() {
    return run_optimize_phase<detail::CudaExecutor, Real>(device.executor, device.control, mesh,
                                                          device.lane.shapes(), request);
  };
  return float32 ? run.template operator()<float>() : run.template operator()<double>();
}

std::vector<NodeId> opposite_nodes_on_device(const FlatMesh& mesh) {
  DeviceSession device;
  const OnDevice<double> there(device.executor, mesh, device.lane.shapes());
  const auto opposite = detail::find_opposite_nodes(device.executor, there.around);
  return downloaded(device.executor, opposite.data(), opposite.size());
}

}  // namespace meshsmooth::test
