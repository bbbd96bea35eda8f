#include "smooth/canonical_smoother.hpp"

#include <string>
#include <utility>

#include "meshsmooth/canonical_topology.hpp"
#include "meshsmooth/error.hpp"
#include "smooth/base/find_not_canonical.hpp"
#include "smooth/base/forwarding_smoother.hpp"
#include "smooth/base/interrupt.hpp"

namespace meshsmooth::detail {
namespace {

/// A prepared topology that has collapsed elements.
struct PreparedExpanded final : PreparedTopology {
  explicit PreparedExpanded(const TopologyView& given) : canonical(given) { topology = given; }
  [[nodiscard]] MemoryEstimate bytes() const override {
    MemoryEstimate sum = inner->bytes();
    sum.host_bytes += canonical.bytes();
    return sum;
  }
  [[nodiscard]] std::int64_t boundary_node_count() const override {
    return inner->boundary_node_count();
  }

  CanonicalTopology canonical;
  std::shared_ptr<const PreparedTopology> inner;  // of `canonical`
};

/// Names the elements of a job by the caller's ids.
void complete(const CanonicalTopology& canonical, SmoothSummary& summary) {
  canonical.complete(summary.quality_before);
  canonical.complete(summary.quality_after);
  canonical.complete(summary.element_quality);
  if (summary.locked.worst) {
    summary.locked.worst->element = canonical.caller_id(summary.locked.worst->element);
  }
  if (summary.motion) {
    for (std::int64_t& element : summary.motion->blocking_elements) {
      element = canonical.caller_id(element);
    }
  }
  summary.nodes.coincident = canonical.coincident_count();
  summary.host_peak_bytes += canonical.bytes();
}

/// The error of a job on a canonical topology, with the caller's id of the element that it names.
[[noreturn]] void rethrow(const InvalidMesh& error, const CanonicalTopology& canonical) {
  ErrorDetails details = error.details();
  std::string text = error.what();
  for (auto& [name, value] : details) {
    if (name != "element") continue;
    const std::string named = "element " + value;
    value = std::to_string(canonical.caller_id(std::stoll(value)));
    if (const auto at = text.find(named); at != std::string::npos) {
      text.replace(at, named.size(), "element " + value);
    }
  }
  throw InvalidMesh(error.reason(), text, details);
}

class CanonicalSmoother final : public ForwardingSmoother {
 public:
  using ForwardingSmoother::ForwardingSmoother;

  [[nodiscard]] std::shared_ptr<const PreparedTopology> prepare(
      const TopologyView& topology, const JobControl& control,
      const PositionsView& reference) override {
    try {
      return inner().prepare(topology, control, reference);
    } catch (const InvalidMesh& error) {
      if (error.reason() != "REPEATED_NODE") throw;
    }
    auto expanded = std::make_shared<PreparedExpanded>(topology);
    expanded->inner = inner().prepare(expanded->canonical.view(), control, reference);
    expanded->reference = expanded->inner->reference;
    return expanded;
  }

  using Smoother::smooth;
  SmoothSummary smooth(const TopologyView& topology, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    try {
      return inner().smooth(topology, positions, options, control);
    } catch (const NotCanonical&) {
    } catch (const InvalidMesh& error) {
      if (error.reason() != "REPEATED_NODE") throw;
    }
    return smooth_canonical(topology, positions, options, control);
  }

  SmoothSummary smooth(const PreparedTopology& prepared, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    try {
      const auto* expanded = dynamic_cast<const PreparedExpanded*>(&prepared);
      if (expanded == nullptr) return inner().smooth(prepared, positions, options, control);
      SmoothSummary summary = inner().smooth(*expanded->inner, positions, options, control);
      complete(expanded->canonical, summary);
      return summary;
    } catch (const NotCanonical&) {
      // By the positions of this job: others on the same topology are not changed by it.
      return smooth_canonical(prepared.topology, positions, options, control);
    }
  }

 private:
  SmoothSummary smooth_canonical(const TopologyView& topology, const JobPositions& positions,
                                 const SmoothOptions& options, const JobControl& control) {
    const Interrupt interrupt(control);
    interrupt.check();
    const CanonicalTopology canonical(topology, positions.given,
                                      options.boundary != BoundaryPolicy::fixed,
                                      [&interrupt] { interrupt.check(); });
    interrupt.check();
    if (control.on_extra_memory) control.on_extra_memory(canonical.bytes());
    try {
      SmoothSummary summary = inner().smooth(canonical.view(), positions, options, control);
      complete(canonical, summary);
      return summary;
    } catch (const InvalidMesh& error) {
      rethrow(error, canonical);
    }
  }
};

}  // namespace

std::unique_ptr<Smoother> make_canonical_smoother(std::unique_ptr<Smoother> inner) {
  return std::make_unique<CanonicalSmoother>(std::move(inner));
}

}  // namespace meshsmooth::detail
