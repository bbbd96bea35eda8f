#pragma once

#include <utility>

#include "smooth/base/job_mesh.hpp"
#include "smooth/cuda/primitives/executor.cuh"

namespace meshsmooth::detail {

/// Calls `body.operator()<nodes per element>()` for a type. Covers every row of the element table.
template <class Body>
void with_width(ElementType type, const Body& body) {
  [&]<std::size_t... kType>(std::index_sequence<kType...>) {
    static_cast<void>(((type == kLinearTypes[kType] &&
                        (body.template operator()<kNodesPerElement[kType]>(), true)) ||
                       ...));
  }
  (std::make_index_sequence<kLinearTypeCount>());
}

/// Calls `body.operator()<nodes per element>(run, its element count)` for each run.
template <class Body>
void for_each_run(CudaExecutor& executor, const JobElements<CudaExecutor>& elements,
                  const Body& body) {
  for (int r = 0; r < elements.view.run_count; ++r) {
    const Elements::Run& run = elements.view.runs[r];
    const std::size_t end =
        r + 1 < elements.view.run_count ? elements.view.runs[r + 1].first : elements.view.count;
    with_width(static_cast<ElementType>(run.shape - executor.lane().shapes()),
               [&]<int kWidth>() { body.template operator()<kWidth>(run, end - run.first); });
  }
}

/// Whether all elements are of one type.
[[nodiscard]] inline bool is_only(CudaExecutor& executor, const Elements& elements,
                                  ElementType type) {
  return elements.run_count == 1 &&
         elements.runs[0].shape == executor.lane().shapes() + static_cast<int>(type);
}

}  // namespace meshsmooth::detail
