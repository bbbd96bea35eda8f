#include "smooth/paired_smoother.hpp"

#include <utility>

#include "smooth/base/forwarding_smoother.hpp"

namespace meshsmooth::detail {
namespace {

class PairedSmoother final : public ForwardingSmoother {
 public:
  using ForwardingSmoother::ForwardingSmoother;

  [[nodiscard]] MemoryEstimate estimate(const MeshSize& size,
                                        const SmoothOptions& options) const override {
    MemoryEstimate sum = inner().estimate(size, options);
    if (size.node_pairs) sum.host_bytes += size.node_count;
    return sum;
  }

  using Smoother::smooth;
  SmoothSummary smooth(const TopologyView& topology, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    const SmoothOptions definite = with_target_of(options, positions.input);
    if (positions.input.node_pairs.empty()) {
      return inner().smooth(topology, positions, definite, control);
    }
    const HeldPairs held = hold_node_pairs(topology, positions.input);
    TopologyView with_pairs = topology;
    with_pairs.fixed = held.fixed;
    SmoothSummary summary = inner().smooth(with_pairs, positions, definite, control);
    summary.nodes.paired = held.paired;
    summary.host_peak_bytes += static_cast<std::int64_t>(held.fixed.size());
    return summary;
  }
  SmoothSummary smooth(const PreparedTopology& prepared, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    if (positions.input.node_pairs.empty()) {
      return inner().smooth(prepared, positions, with_target_of(options, positions.input), control);
    }
    return smooth(prepared.topology, positions, options, control);
  }
};

}  // namespace

std::unique_ptr<Smoother> make_paired_smoother(std::unique_ptr<Smoother> inner) {
  return std::make_unique<PairedSmoother>(std::move(inner));
}

}  // namespace meshsmooth::detail
