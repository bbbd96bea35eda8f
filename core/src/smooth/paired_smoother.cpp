#include "smooth/paired_smoother.hpp"

#include <utility>

namespace meshsmooth::detail {
namespace {

class PairedSmoother final : public Smoother {
 public:
  explicit PairedSmoother(std::unique_ptr<Smoother> inner) : inner_(std::move(inner)) {}

  [[nodiscard]] std::string_view backend() const override { return inner_->backend(); }
  [[nodiscard]] DeviceSpace device_space() const override { return inner_->device_space(); }
  [[nodiscard]] MemoryEstimate estimate(const MeshSize& size,
                                        const SmoothOptions& options) const override {
    MemoryEstimate sum = inner_->estimate(size, options);
    if (size.node_pairs || !options.node_pairs.empty()) sum.host_bytes += size.node_count;
    return sum;
  }
  [[nodiscard]] MemoryEstimate estimate_prepared(const MeshSize& size) const override {
    return inner_->estimate_prepared(size);
  }
  [[nodiscard]] bool reads_positions_once(const MeshSize& size) const override {
    return inner_->reads_positions_once(size);
  }
  [[nodiscard]] std::shared_ptr<const PreparedTopology> prepare(
      const TopologyView& topology, const JobControl& control,
      const PositionsView& reference) override {
    return inner_->prepare(topology, control, reference);
  }

  using Smoother::smooth;
  SmoothSummary smooth(const TopologyView& topology, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    if (options.node_pairs.empty()) return inner_->smooth(topology, positions, options, control);
    const HeldPairs held = hold_node_pairs(topology, options);
    TopologyView with_pairs = topology;
    with_pairs.fixed = held.fixed;
    SmoothSummary summary = inner_->smooth(with_pairs, positions, options, control);
    summary.nodes.paired = held.paired;
    summary.host_peak_bytes += static_cast<std::int64_t>(held.fixed.size());
    return summary;
  }
  SmoothSummary smooth(const PreparedTopology& prepared, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    if (options.node_pairs.empty()) return inner_->smooth(prepared, positions, options, control);
    return smooth(prepared.topology, positions, options, control);
  }

 private:
  std::unique_ptr<Smoother> inner_;
};

}  // namespace

std::unique_ptr<Smoother> make_paired_smoother(std::unique_ptr<Smoother> inner) {
  return std::make_unique<PairedSmoother>(std::move(inner));
}

}  // namespace meshsmooth::detail
