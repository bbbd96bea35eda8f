#include "smooth/cpu/cpu_smoother.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include "smooth/cpu/cpu_prepared.hpp"
#include "smooth/cpu/cpu_topology.hpp"
#include "smooth/steps/memory_model.hpp"
#include "smooth/steps/pipeline.hpp"

namespace meshsmooth::detail {
namespace {

/// Judges a job in host memory and in internal order, and gives the caller's
/// ids back.
class CpuEvaluator {
 public:
  CpuEvaluator(CpuExecutor& executor, QualityDetail quality_detail)
      : executor_(executor), quality_detail_(quality_detail) {}

  class Orientation {
   public:
    Orientation() = default;
    Orientation(SurfaceOrientation judged, ByteCount& bytes) : judged_(std::move(judged)) {
      bytes.add(judged_.normals().size_bytes());  // lives as long as the job
    }
    [[nodiscard]] const PackedDirection* references() const {
      return judged_.normals().empty() ? nullptr : judged_.normals().data();
    }
    [[nodiscard]] Vec3d common() const { return judged_.common(); }
    [[nodiscard]] const SurfaceOrientation& judged() const { return judged_; }

   private:
    SurfaceOrientation judged_;
  };

  template <class Real>
  using Mesh = JobMesh<CpuExecutor, Real>;

  template <class Real>
  [[nodiscard]] Orientation orientation(const Mesh<Real>& job) const {
    return in_arena(job, [&](const auto& topology, const auto& positions) {
      return Orientation(SurfaceOrientation(topology, positions), executor_.bytes());
    });
  }

  template <class Real>
  [[nodiscard]] QualityStats quality(const Mesh<Real>& job, const Orientation& orientation) const {
    return in_arena(job, [&](const auto& topology, const auto& positions) {
      return measure_quality(topology, positions, orientation.judged(), caller_ids(job.elements),
                             quality_detail_);
    });
  }

  template <class Real>
  [[nodiscard]] Verdict verdict(const Mesh<Real>& job, const Orientation& orientation) const {
    return {quality(job, orientation),
            in_arena(job, [&](const auto& topology, const auto& positions) {
              return measure_locked(topology, {job.fixed.data(), job.node_count}, positions,
                                    orientation.judged(), caller_ids(job.elements));
            })};
  }

  /// Free nodes to the caller's array; gives how many differ from the input.
  template <class Real>
  const std::int64_t* write_back(const Mesh<Real>& job, std::span<Vec3<Real>> positions) {
    const std::size_t node_count = positions.size();
    const NodeId* const caller_ids = job.caller_ids.data();
    const std::uint8_t* const fixed = job.fixed.data();
    const Vec3<Real>* const places = job.places.data();
    Vec3<Real>* const out = positions.data();
    executor_.check();  // the last chance to end without a result
    moved_ = run_in(executor_.arena(), [&] {
      return parallel_reduce(
          node_count, std::int64_t{0},
          [=](std::size_t begin, std::size_t end) {
            std::int64_t moved = 0;
            for (std::size_t node = begin; node != end; ++node) {
              Vec3<Real>& target = out[caller_ids[node]];
              if (fixed[node] != 0 || places[node] == target) continue;
              target = places[node];
              ++moved;
            }
            return moved;
          },
          std::plus<>());
    });
    return &moved_;
  }

 private:
  template <class Real, class Body>
  auto in_arena(const Mesh<Real>& job, const Body& body) const {
    const std::vector<ElementBlockView> blocks = block_views(job.elements);
    const TopologyView topology{job.node_count, blocks, {}};
    const PositionsView positions = std::span<const Vec3<Real>>(job.places.data(), job.node_count);
    return run_in(executor_.arena(), [&] { return body(topology, positions); });
  }

  static std::span<const ElementId> caller_ids(const JobElements<CpuExecutor>& elements) {
    return {elements.caller_ids.data(), elements.view.count};
  }

  CpuExecutor& executor_;
  QualityDetail quality_detail_;
  std::int64_t moved_ = 0;
};

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
    return {estimate_bytes(size, options, thread_count_), 0};
  }

  using Smoother::smooth;
  SmoothSummary smooth(const TopologyView& topology, PositionsSpan positions,
                       const SmoothOptions& options, const JobControl& control) override {
    validate(options);
    run_in(arena_, [&] { validate(topology, as_view(positions)); });
    return run(positions, control, [&](CpuExecutor& executor, auto span) {
      return run_pipeline(executor, topology, span, options, control,
                          CpuEvaluator(executor, options.quality_detail));
    });
  }

  [[nodiscard]] MemoryEstimate estimate_prepared(const MeshSize& size) const override {
    return {prepared_bytes(size), 0};
  }

  [[nodiscard]] std::shared_ptr<const PreparedTopology> prepare(
      const TopologyView& topology, const JobControl& control) override {
    refuse_too_large(topology);
    run_in(arena_, [&] { validate(topology); });
    const Interrupt interrupt(control);
    CpuExecutor executor(arena_, interrupt);
    executor.check();
    return prepare_topology(executor, topology, control);
  }

  SmoothSummary smooth(const PreparedTopology& prepared, PositionsSpan positions,
                       const SmoothOptions& options, const JobControl& control) override {
    validate(options);
    const auto& own = dynamic_cast<const CpuPreparedTopology&>(prepared);
    run_in(arena_, [&] { validate_positions(own.topology, as_view(positions)); });
    return run(positions, control,
               [&]<class Real>(CpuExecutor& executor, std::span<Vec3<Real>> span) {
                 StageTimes times;
                 auto job = prepare_job(executor, own, std::span<const Vec3<Real>>(span), options,
                                        control, times);
                 return run_prepared(executor, own.topology, std::move(job), span, options, control,
                                     CpuEvaluator(executor, options.quality_detail), times);
               });
  }

 private:
  /// Runs a job by `body(executor, positions)` and says where.
  template <class Body>
  SmoothSummary run(PositionsSpan positions, const JobControl& control, const Body& body) {
    return std::visit(
        [&](auto span) {
          const Interrupt interrupt(control);
          CpuExecutor executor(arena_, interrupt);
          executor.check();
          SmoothSummary summary = body(executor, span);
          summary.backend = backend();
          summary.device_name = device_name_;
          summary.thread_count = thread_count_;
          summary.host_peak_bytes = static_cast<std::int64_t>(executor.bytes().peak());
          return summary;
        },
        positions);
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
