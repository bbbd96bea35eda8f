#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/device_session.cuh"
#include "smooth/cuda/backend.cuh"

namespace meshsmooth::test {
namespace {

using detail::CudaExecutor;

template <class Real>
DeviceEvaluation evaluate(const Mesh& mesh, const FlatMesh& flat, QualityDetail detail,
                          std::vector<Vec3<Real>> given) {
  DeviceSession device;
  CudaExecutor& executor = device.executor;
  OnDevice<Real> there(executor, flat, device.lane.shapes());
  detail::JobMesh<CudaExecutor, Real> job;
  job.node_count = flat.node_count();
  job.given = uploaded(executor, given);
  job.caller_ids = std::move(there.caller_ids);
  job.elements.view = there.around.elements;
  job.elements.dimension = flat.dimension;
  job.elements.caller_ids = std::move(there.element_caller_ids);
  job.positions = std::move(there.positions);
  job.fixed = std::move(there.fixed);

  const MeshTopology topology(mesh);
  const TopologyView view = topology.view();
  detail::CudaBackend backend(executor, view, std::span<const Vec3<Real>>(given), detail);
  const auto orientation = backend.orient(job);
  DeviceEvaluation result;
  result.quality = backend.evaluate(job, orientation);
  result.locked = backend.evaluate_result(job, orientation).locked;
  result.elements =
      backend.evaluate_elements(job, orientation, {kQualityMetrics.begin(), kQualityMetrics.end()});
  const std::int64_t* const moved = backend.write_back(job, std::span<Vec3<Real>>(given));
  executor.finish();
  result.moved = *moved;
  result.written = positions_as<double>(given);
  return result;
}

}  // namespace

DeviceEvaluation evaluate_on_device(const Mesh& mesh, const FlatMesh& flat, QualityDetail detail) {
  return std::visit([&](const auto& given) { return evaluate(mesh, flat, detail, given); },
                    mesh.positions);
}

}  // namespace meshsmooth::test
