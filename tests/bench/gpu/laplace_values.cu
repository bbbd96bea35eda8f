#include "gpu/laplace_values.hpp"

#include <chrono>
#include <span>
#include <vector>

#include "gpu/report.hpp"
#include "smooth/cuda/backend.cuh"
#include "smooth/linear/laplace_matrix.hpp"

namespace meshsmooth::bench {

double laplace_values_ms(const BenchMesh& mesh, int repeats) {
  const ElementBlockView block{ElementType::tetrahedron, mesh.tetrahedra};
  const TopologyView topology{mesh.node_count(), {&block, 1}, {}};
  const std::span<const Vec3d> positions(mesh.positions);
  const JobControl control;
  const detail::Interrupt interrupt(control);
  detail::CudaLane lane(0);
  detail::CudaExecutor executor(lane, interrupt);
  detail::CudaBackend backend(executor, topology, positions, QualityDetail::brief);
  SmoothOptions options;
  options.method = Optimize{};  // so that the balls are kept
  StageTimes stages;
  const auto job = backend.prepare(topology, positions, detail::plan_job(options), control, stages);
  const detail::Surroundings around{job.node_count,   job.elements.view, job.rings.view(),
                                    job.balls.view(), job.fixed.data(),  nullptr,
                                    Vec3d{0, 0, 0}};
  auto values = executor.allocate<float>(job.rings.entries.size());
  std::vector<double> times;
  for (int n = 0; n <= repeats; ++n) {
    executor.synchronize();
    const auto begin = std::chrono::steady_clock::now();
    detail::assemble_laplace(executor, around, job.positions.data(), values.data());
    executor.synchronize();
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
    if (n > 0) times.push_back(time.count());
  }
  executor.finish();
  return median(times);
}

}  // namespace meshsmooth::bench
