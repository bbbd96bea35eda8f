#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace meshsmooth::detail {

/// The parts of a job, by the memory that they hold. Every allocation belongs to the one that the
/// job has entered last.
enum class JobStage {
  none,  // before the first: nothing is allocated
  order_nodes,
  find_neighbours,
  find_boundary,
  find_coincident,
  find_reference,
  constrain,
  measure_input,
  find_boxes,
  find_anchors,
  fix_outside,
  colour,
  iterate,
  measure_result,
  keep_quality,
  recount_poor,
};
inline constexpr std::size_t kJobStageCount = 16;

inline constexpr std::array<std::string_view, kJobStageCount> kJobStageNames = {
    "none",           "order_nodes", "find_neighbours", "find_boundary",  "find_coincident",
    "find_reference", "constrain",   "measure_input",   "find_boxes",     "find_anchors",
    "fix_outside",    "colour",      "iterate",         "measure_result", "keep_quality",
    "recount_poor"};

/// Upper bounds of the bytes that a job holds, by its stages.
struct MemoryPlan {
  std::int64_t kept = 0;                              // from the first stage to the last
  std::int64_t beside = 0;                            // sums and histograms of any stage
  std::array<std::int64_t, kJobStageCount> stages{};  // what each holds besides

  [[nodiscard]] std::int64_t& operator[](JobStage stage) {
    return stages.at(static_cast<std::size_t>(stage));
  }
  /// While a stage lasts. What is found is a little more than what sizes tell.
  [[nodiscard]] std::int64_t during(JobStage stage) const {
    return with_margin(kept + stages.at(static_cast<std::size_t>(stage)));
  }
  /// The estimate: that of the stage that holds most.
  [[nodiscard]] std::int64_t peak() const {
    return with_margin(kept + *std::ranges::max_element(stages));
  }

 private:
  [[nodiscard]] std::int64_t with_margin(std::int64_t bytes) const {
    return bytes + bytes / 50 + beside;
  }
};

}  // namespace meshsmooth::detail
