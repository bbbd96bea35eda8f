#include "smooth/cuda/smoother.hpp"

#include <algorithm>
#include <string>

#include "meshsmooth/error.hpp"
#include "smooth/cuda/backend.cuh"
#include "smooth/cuda/estimate.cuh"
#include "smooth/pipeline/pipeline.hpp"

// No anonymous namespace; see sweeps/optimize.cu.
namespace meshsmooth::detail {

static void use_device(int device) { check_cuda(cudaSetDevice(device), "selecting a device"); }

class CudaSmoother final : public Smoother {
 public:
  explicit CudaSmoother(int device)
      : name_("cuda:" + std::to_string(device)), lane_((use_device(device), device)) {
    cudaDeviceProp properties{};
    check_cuda(cudaGetDeviceProperties(&properties, device), "querying device properties");
    device_name_ = properties.name;
  }
  ~CudaSmoother() override { cudaSetDevice(lane_.device()); }

  [[nodiscard]] std::string_view backend() const override { return name_; }

  [[nodiscard]] DeviceSpace device_space() const override {
    use_device(lane_.device());
    std::size_t free = 0, total = 0;
    check_cuda(cudaMemGetInfo(&free, &total), "querying device memory");
    std::uint64_t kept = 0;
    check_cuda(cudaMemPoolGetAttribute(lane_.pool().get(), cudaMemPoolAttrReleaseThreshold, &kept),
               "querying a memory pool's threshold");
    return {static_cast<std::int64_t>(total), static_cast<std::int64_t>(free),
            static_cast<std::int64_t>(kept)};
  }

  [[nodiscard]] MemoryEstimate estimate(const MeshSize& size,
                                        const SmoothOptions& options) const override {
    return {CudaEvaluator::host_bytes(count_mesh(size), options) + fit_host_bytes(size),
            plan_device_memory(plan_job(options), size, lane_.limits()).peak()};
  }

  /// The sides of a surface are told apart on the host.
  [[nodiscard]] bool reads_positions_once(const MeshSize& size) const override {
    return std::ranges::none_of(kLinearTypes, [&](ElementType type) {
      return element_shape(type).dimension == 2 &&
             size.element_counts[static_cast<std::size_t>(type)] > 0;
    });
  }

  using Smoother::smooth;
  SmoothSummary smooth(const TopologyView& topology, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    return run(topology, positions, options, control, nullptr);
  }

  [[nodiscard]] MemoryEstimate estimate_prepared(const MeshSize& size) const override {
    return {0, prepared_device_bytes(size)};
  }

  [[nodiscard]] std::shared_ptr<const PreparedTopology> prepare(
      const TopologyView& topology, const JobControl& control,
      const PositionsView& reference) override {
    validate_sizes(topology);
    if (position_count(reference) > 0) validate_reference(topology, reference);
    refuse_too_large(topology);
    use_device(lane_.device());
    const Interrupt interrupt(control);
    CudaExecutor executor(lane_, interrupt);
    executor.check();
    return prepare_topology(executor, topology, control, reference);
  }

  SmoothSummary smooth(const PreparedTopology& prepared, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    return run(prepared.topology, positions, options, control,
               &dynamic_cast<const CudaPreparedTopology&>(prepared));
  }

 private:
  SmoothSummary run(const TopologyView& topology, const JobPositions& positions,
                    const SmoothOptions& options, const JobControl& control,
                    const CudaPreparedTopology* prepared) {
    validate(options, positions.input);
    validate_sizes(topology, positions, options);
    validate_input(topology, positions.input, options);
    const JobTopology of_job(topology, options, positions.input.prescribed);
    use_device(lane_.device());
    return std::visit(
        [&](auto span) {
          const JobPlan plan = plan_job(options);
          const Interrupt interrupt(control);
          CudaExecutor executor(lane_, interrupt);
          executor.check();
          const JobArrays arrays{given_positions(positions, span), span, positions.input};
          const bool kept = prepared != nullptr && is_same_array(prepared->reference, arrays.given);
          CudaBackend steps(executor, of_job.view(), arrays.given, plan.evaluated_detail, prepared,
                            kept, positions.kept_on_error ? nullptr : &positions.result);
          SmoothSummary summary = run_pipeline(steps, of_job.view(), arrays, plan, control);
          summary.backend = backend();
          summary.device_name = device_name_;
          summary.device_peak_bytes = static_cast<std::int64_t>(executor.bytes().peak());
          return summary;
        },
        positions.result);
  }

  std::string name_;
  std::string device_name_;
  CudaLane lane_;
};

std::vector<BackendInfo> list_cuda_backends() {
  int count = 0;
  const cudaError_t asked = cudaGetDeviceCount(&count);
  if (asked != cudaSuccess || count == 0) {
    static_cast<void>(cudaGetLastError());
    int driver = 0;
    static_cast<void>(cudaDriverGetVersion(&driver));
    const char* const problem =
        driver == 0 ? "there is no driver"
                    : cudaGetErrorString(asked != cudaSuccess ? asked : cudaErrorNoDevice);
    return {{.name = "cuda", .available = false, .device_name = {}, .problem = problem}};
  }
  std::vector<BackendInfo> backends;
  for (int device = 0; device < count; ++device) {
    cudaDeviceProp properties{};
    const cudaError_t read = cudaGetDeviceProperties(&properties, device);
    if (read != cudaSuccess) {
      static_cast<void>(cudaGetLastError());
      backends.push_back({.name = "cuda:" + std::to_string(device),
                          .available = false,
                          .device_name = {},
                          .problem = cudaGetErrorString(read)});
      continue;
    }
    const bool usable = properties.major * 10 + properties.minor >= 75 &&
                        properties.cooperativeLaunch != 0 && properties.canMapHostMemory != 0 &&
                        properties.memoryPoolsSupported != 0;
    backends.push_back(
        {.name = "cuda:" + std::to_string(device),
         .available = usable,
         .device_name = properties.name,
         .device_bytes = static_cast<std::int64_t>(properties.totalGlobalMem),
         .problem = usable ? "" : "it needs compute capability 7.5 or newer, and memory pools"});
  }
  return backends;
}

std::unique_ptr<Smoother> make_cuda_smoother(int device) {
  return std::make_unique<CudaSmoother>(device);
}

}  // namespace meshsmooth::detail
