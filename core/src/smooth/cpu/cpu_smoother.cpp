#include "smooth/cpu/cpu_smoother.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <fstream>
#include <string>
#include <thread>

#include "smooth/cpu/cpu_backend.hpp"
#include "smooth/cpu/memory_model.hpp"
#include "smooth/pipeline/pipeline.hpp"

namespace meshsmooth::detail {
namespace {

std::string cpu_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "CPU";
}

class CpuSmoother final : public Smoother {
 public:
  explicit CpuSmoother(int thread_count)
      : thread_count_(thread_count > 0 ? thread_count
                                       : static_cast<int>(std::thread::hardware_concurrency())),
        arena_(thread_count_),
        device_name_(cpu_name()) {}

  [[nodiscard]] std::string_view backend() const override { return "cpu"; }

  [[nodiscard]] MemoryEstimate estimate(const MeshSize& size,
                                        const SmoothOptions& options) const override {
    return {plan_memory(plan_job(options), size, thread_count_).peak(), 0};
  }

  using Smoother::smooth;
  SmoothSummary smooth(const TopologyView& topology, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    validate(options, positions.input);
    run_in(arena_, [&] {
      validate(topology);
      validate_given(topology, positions, options);
      validate_input(topology, positions.input, options);
    });
    return run(topology, positions, options, control, nullptr);
  }

  [[nodiscard]] MemoryEstimate estimate_prepared(const MeshSize& size) const override {
    return {prepared_bytes(size), 0};
  }

  [[nodiscard]] std::shared_ptr<const PreparedTopology> prepare(
      const TopologyView& topology, const JobControl& control,
      const PositionsView& reference) override {
    refuse_too_large(topology);
    run_in(arena_, [&] {
      validate(topology);
      if (position_count(reference) > 0) validate_reference(topology, reference);
    });
    const Interrupt interrupt(control);
    CpuExecutor executor(arena_, interrupt);
    executor.check();
    return prepare_topology(executor, topology, control, reference);
  }

  SmoothSummary smooth(const PreparedTopology& prepared, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    validate(options, positions.input);
    const auto& own = dynamic_cast<const CpuPreparedTopology&>(prepared);
    run_in(arena_, [&] {
      validate_given(own.topology, positions, options, own.reference);
      validate_input(own.topology, positions.input, options);
    });
    return run(own.topology, positions, options, control, &own);
  }

 private:
  SmoothSummary run(const TopologyView& topology, const JobPositions& positions,
                    const SmoothOptions& options, const JobControl& control,
                    const CpuPreparedTopology* prepared) {
    return std::visit(
        [&](auto span) {
          const JobPlan plan = plan_job(options);
          const Interrupt interrupt(control);
          CpuExecutor executor(arena_, interrupt);
          executor.check();
          const JobArrays arrays{given_positions(positions, span), span, positions.input};
          KeptReference<CpuExecutor>* const kept =
              prepared != nullptr && is_same_array(prepared->reference, arrays.given)
                  ? prepared->kept.get()
                  : nullptr;
          CpuBackend steps(executor, plan.evaluated_detail, prepared, kept);
          const JobTopology of_job(topology, options, arrays.input.prescribed);
          SmoothSummary summary = run_pipeline(steps, of_job.view(), arrays, plan, control);
          summary.backend = backend();
          summary.device_name = device_name_;
          summary.thread_count = thread_count_;
          summary.host_peak_bytes = static_cast<std::int64_t>(executor.bytes().peak());
          return summary;
        },
        positions.result);
  }

  int thread_count_;
  tbb::task_arena arena_;
  std::string device_name_;
};

}  // namespace

std::unique_ptr<Smoother> make_cpu_smoother(int thread_count) {
  return std::make_unique<CpuSmoother>(thread_count);
}

}  // namespace meshsmooth::detail

namespace meshsmooth {

struct ThreadLimit::Impl {
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int thread_count)
    : impl_(new Impl{{tbb::global_control::max_allowed_parallelism,
                      static_cast<std::size_t>(thread_count)}}) {}

ThreadLimit::~ThreadLimit() = default;

}  // namespace meshsmooth
