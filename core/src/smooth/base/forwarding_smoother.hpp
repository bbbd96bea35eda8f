#pragma once

#include <memory>
#include <utility>

#include "meshsmooth/smoother.hpp"

namespace meshsmooth::detail {

/// A smoother that leaves everything to another one: the base of those that change a part of it.
class ForwardingSmoother : public Smoother {
 public:
  explicit ForwardingSmoother(std::unique_ptr<Smoother> inner) : inner_(std::move(inner)) {}

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
    return inner_->prepare(topology, control, reference);
  }

  using Smoother::smooth;
  SmoothSummary smooth(const TopologyView& topology, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    return inner_->smooth(topology, positions, options, control);
  }
  SmoothSummary smooth(const PreparedTopology& prepared, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    return inner_->smooth(prepared, positions, options, control);
  }

 protected:
  [[nodiscard]] Smoother& inner() const { return *inner_; }

 private:
  std::unique_ptr<Smoother> inner_;
};

}  // namespace meshsmooth::detail
