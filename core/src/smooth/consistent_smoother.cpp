#include "smooth/consistent_smoother.hpp"

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "smooth/mirrored_elements.hpp"

namespace meshsmooth::detail {
namespace {

/// A kept topology; where a job has found mirrored elements, also the one without them.
struct PreparedConsistent final : PreparedTopology {
  struct Other {
    Other(const TopologyView& view, Numbering found)
        : numbering(std::move(found)), topology(view, numbering.mirrored) {}
    Numbering numbering;
    ConsistentTopology topology;
  };

  explicit PreparedConsistent(std::shared_ptr<const PreparedTopology> of_inner)
      : inner(std::move(of_inner)) {
    topology = inner->topology;
    reference = inner->reference;
  }
  [[nodiscard]] MemoryEstimate bytes() const override { return inner->bytes(); }
  [[nodiscard]] std::int64_t boundary_node_count() const override {
    return inner->boundary_node_count();
  }

  std::shared_ptr<const PreparedTopology> inner;
  mutable std::mutex mutex;
  mutable std::shared_ptr<const Other> other;  // guarded
};

class ConsistentSmoother final : public Smoother {
 public:
  explicit ConsistentSmoother(std::unique_ptr<Smoother> inner) : inner_(std::move(inner)) {}

  [[nodiscard]] std::string_view backend() const override { return inner_->backend(); }
  [[nodiscard]] DeviceSpace device_space() const override { return inner_->device_space(); }
  [[nodiscard]] MemoryEstimate estimate(const MeshSize& size,
                                        const SmoothOptions& options) const override {
    return inner_->estimate(size, options);
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
    return std::make_shared<PreparedConsistent>(inner_->prepare(topology, control, reference));
  }

  using Smoother::smooth;
  SmoothSummary smooth(const TopologyView& topology, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    try {
      return inner_->smooth(topology, positions, options, control);
    } catch (const MirroredElements& found) {
      const ConsistentTopology consistent(topology, found.numbering.mirrored);
      return smooth_consistent(consistent, found.numbering, positions, options, control);
    }
  }

  SmoothSummary smooth(const PreparedTopology& prepared, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    const auto* own = dynamic_cast<const PreparedConsistent*>(&prepared);
    if (own == nullptr) return inner_->smooth(prepared, positions, options, control);
    std::shared_ptr<const PreparedConsistent::Other> other;
    {
      const std::lock_guard lock(own->mutex);
      other = own->other;
    }
    if (other == nullptr) {
      try {
        return inner_->smooth(*own->inner, positions, options, control);
      } catch (const MirroredElements& found) {
        other = std::make_shared<const PreparedConsistent::Other>(own->topology, found.numbering);
      }
      const std::lock_guard lock(own->mutex);
      own->other = other;
    }
    return smooth_consistent(other->topology, other->numbering, positions, options, control);
  }

 private:
  SmoothSummary smooth_consistent(const ConsistentTopology& topology, const Numbering& numbering,
                                  const JobPositions& positions, const SmoothOptions& options,
                                  const JobControl& control) {
    SmoothSummary summary = inner_->smooth(topology.view(), positions, options, control);
    list_mirrored(numbering, summary.quality_before);
    list_mirrored(numbering, summary.quality_after);
    summary.host_peak_bytes += topology.bytes();
    return summary;
  }

  std::unique_ptr<Smoother> inner_;
};

}  // namespace

std::unique_ptr<Smoother> make_consistent_smoother(std::unique_ptr<Smoother> inner) {
  return std::make_unique<ConsistentSmoother>(std::move(inner));
}

}  // namespace meshsmooth::detail
