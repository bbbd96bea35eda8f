#include "smooth/second_order/second_order_smoother.hpp"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "mesh/parallel.hpp"
#include "meshsmooth/error.hpp"
#include "smooth/base/forwarding_smoother.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/base/refusals.hpp"
#include "smooth/move/prescribed.hpp"
#include "smooth/second_order/keep_curved_quality.hpp"
#include "smooth/second_order/mid_derivatives.hpp"
#include "smooth/second_order/repair_curved.hpp"
#include "smooth/second_order/second_order_job.hpp"

namespace meshsmooth::detail {
namespace {

/// A topology of second order that is kept: the mesh of its corners, prepared.
struct PreparedSecondOrder final : PreparedTopology {
  explicit PreparedSecondOrder(const TopologyView& view) : corners(view) { topology = view; }

  [[nodiscard]] MemoryEstimate bytes() const override {
    MemoryEstimate sum = linear->bytes();
    sum.host_bytes += corners.bytes();
    return sum;
  }
  [[nodiscard]] std::int64_t boundary_node_count() const override {
    return linear->boundary_node_count();
  }

  CornerMesh corners;
  std::shared_ptr<const PreparedTopology> linear;  // of `corners`
};

class SecondOrderSmoother final : public ForwardingSmoother {
 public:
  SecondOrderSmoother(std::unique_ptr<Smoother> linear, int thread_count)
      : ForwardingSmoother(std::move(linear)),
        arena_(thread_count > 0 ? thread_count : tbb::task_arena::automatic) {}

  [[nodiscard]] MemoryEstimate estimate(const MeshSize& size,
                                        const SmoothOptions& options) const override {
    MemoryEstimate sum = inner().estimate(CornerMesh::size_of(size), options);
    const JobPlan plan = plan_job(options);
    if (plan.improves()) {
      sum.host_bytes = std::max(sum.host_bytes, repair_bytes(size));  // one after the other
    }
    if (plan.keeps_quality && is_second_order(size)) {
      sum.host_bytes = std::max(sum.host_bytes, keep_curved_quality_bytes(size.node_count));
    }
    if (plan.derivative != Derivative::none && is_second_order(size)) {
      sum.host_bytes += MidDerivatives<double>::estimate_bytes(size.node_count);
    }
    sum.host_bytes += job_bytes(size) + CornerMesh::estimate_bytes(size);
    return sum;
  }
  [[nodiscard]] MemoryEstimate estimate_prepared(const MeshSize& size) const override {
    MemoryEstimate sum = inner().estimate_prepared(CornerMesh::size_of(size));
    sum.host_bytes += CornerMesh::estimate_bytes(size);
    return sum;
  }

  [[nodiscard]] bool reads_positions_once(const MeshSize& size) const override {
    return !is_second_order(size) && inner().reads_positions_once(size);
  }

  [[nodiscard]] std::shared_ptr<const PreparedTopology> prepare(
      const TopologyView& topology, const JobControl& control,
      const PositionsView& reference) override {
    if (!is_second_order(topology)) return inner().prepare(topology, control, reference);
    run_in(arena_, [&] { validate(topology); });
    auto result = std::make_shared<PreparedSecondOrder>(topology);
    result->linear =
        with_own_facets(topology, [&] { return inner().prepare(result->corners.view(), control); });
    return result;
  }

  using Smoother::smooth;
  SmoothSummary smooth(const TopologyView& topology, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    refuse_surface_on(topology, positions.input);
    if (!is_second_order(topology)) return inner().smooth(topology, positions, options, control);
    validate(options, positions.input);
    run_in(arena_, [&] {
      validate(topology);
      validate_given(topology, positions, options);
      validate_input(topology, positions.input, options);
    });
    const CornerMesh corners(topology);
    return run(topology, corners, nullptr, positions, options, control);
  }

  SmoothSummary smooth(const PreparedTopology& prepared, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    refuse_surface_on(prepared.topology, positions.input);
    const auto* own = dynamic_cast<const PreparedSecondOrder*>(&prepared);
    if (own == nullptr) return inner().smooth(prepared, positions, options, control);
    validate(options, positions.input);
    run_in(arena_, [&] {
      validate_given(own->topology, positions, options);
      validate_input(own->topology, positions.input, options);
    });
    return run(own->topology, own->corners, own->linear.get(), positions, options, control);
  }

 private:
  /// Positions of all nodes and of the corners, those of a reference, and marks.
  [[nodiscard]] static std::int64_t job_bytes(const MeshSize& size) {
    if (!is_second_order(size)) return 0;
    const std::int64_t position = size.float64 ? sizeof(Vec3d) : sizeof(Vec3f);
    return size.node_count * (position + 1) +
           CornerMesh::size_of(size).node_count *
               (position + static_cast<std::int64_t>(sizeof(Vec3d)) + 1);
  }

  /// Errors about facets name the caller's nodes.
  template <class Work>
  static std::invoke_result_t<const Work&> with_own_facets(const TopologyView& topology,
                                                           const Work& work) {
    try {
      return work();
    } catch (const InvalidMesh& error) {
      if (error.reason() == "FACET_OVERUSED") throw_overused_facet(topology);
      throw;
    }
  }

  SmoothSummary run(const TopologyView& topology, const CornerMesh& mesh,
                    const PreparedTopology* prepared, const JobPositions& positions,
                    const SmoothOptions& options, const JobControl& control) {
    return std::visit(
        [&]<class Real>(std::span<Vec3<Real>> span) {
          const SmoothCorners<Real> smooth_corners =
              [&](std::vector<Vec3<Real>>& corners, const JobInput& input,
                  const SmoothOptions& of_corners, const std::vector<NodeId>& held) {
                return with_own_facets(topology, [&] {
                  JobPositions all{std::span(corners)};
                  all.input = input;
                  if (held.empty() && prepared != nullptr) {
                    return inner().smooth(*prepared, all, of_corners, control);
                  }
                  TopologyView view = mesh.view();
                  std::vector<std::uint8_t> fixed(view.fixed.begin(), view.fixed.end());
                  if (!held.empty()) {
                    fixed.resize(view.node_count);
                    for (const NodeId node : held) fixed[static_cast<std::size_t>(node)] = 1;
                    view.fixed = fixed;
                  }
                  return inner().smooth(view, all, of_corners, control);
                });
              };
          const JobPlan plan = plan_job(options);
          SmoothSummary summary =
              smooth_second_order<Real>({arena_, topology, mesh, plan, control, smooth_corners},
                                        {given_positions(positions, span), span, positions.input});
          summary.host_peak_bytes += mesh.bytes() + job_bytes(detail::size_of(topology));
          return summary;
        },
        positions.result);
  }

  tbb::task_arena arena_;
};

}  // namespace

std::unique_ptr<Smoother> make_second_order_smoother(std::unique_ptr<Smoother> linear,
                                                     int thread_count) {
  return std::make_unique<SecondOrderSmoother>(std::move(linear), thread_count);
}

}  // namespace meshsmooth::detail
