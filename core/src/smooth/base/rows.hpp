#pragma once

#include "smooth/base/executor.hpp"
#include "smooth/base/topology.hpp"

namespace meshsmooth::detail {

/// Owns rows of ids.
template <class E, class Id>
struct RowBuffer {
  typename E::template Buffer<std::int64_t> offsets;
  typename E::template Buffer<Id> entries;
  [[nodiscard]] Rows<Id> view() const { return {offsets.data(), entries.data()}; }
};

/// Counting sort of items into rows.
///
/// takes  `visit(item, emit)` calls `emit(row)` for every row the item belongs to
/// gives  per row the ids of its items, ascending by `key(item)`
/// cost   O(items + rows), 8 B a row and 4 B an entry, 4 B a row while it runs
/// order  deterministic: rows are filled in any order, then sorted
template <Executor E, class Visit, class Key>
RowBuffer<E, ElementId> group_items(E& executor, std::size_t row_count, std::size_t item_count,
                                    const Visit& visit, const Key& key) {
  RowBuffer<E, ElementId> rows;
  rows.offsets = executor.template allocate<std::int64_t>(row_count + 1);
  auto fill = executor.template allocate<std::uint32_t>(row_count);
  std::int64_t* const offsets = rows.offsets.data();
  std::uint32_t* const filled = fill.data();
  const auto add = executor.adder();

  executor.for_each(row_count, [=] MESHSMOOTH_HD(std::size_t row) { filled[row] = 0; });
  executor.for_each(item_count, [=] MESHSMOOTH_HD(std::size_t item) {
    visit(item, [=](NodeId row) { add(filled[row], std::uint32_t{1}); });
  });
  executor.for_each(row_count + 1, [=] MESHSMOOTH_HD(std::size_t row) {
    offsets[row] = row < row_count ? filled[row] : 0;
    if (row < row_count) filled[row] = 0;
  });
  const std::int64_t entry_count = executor.exclusive_scan(offsets, row_count + 1);

  rows.entries = executor.template allocate<ElementId>(static_cast<std::size_t>(entry_count));
  ElementId* const entries = rows.entries.data();
  executor.for_each(item_count, [=] MESHSMOOTH_HD(std::size_t item) {
    visit(item, [=](NodeId row) {
      const std::uint32_t slot = add(filled[row], std::uint32_t{1});
      entries[offsets[row] + slot] = static_cast<ElementId>(item);
    });
  });
  executor.for_each(row_count, [=] MESHSMOOTH_HD(std::size_t row) {
    sort_row(entries + offsets[row], static_cast<std::size_t>(offsets[row + 1] - offsets[row]),
             key);
  });
  return rows;
}

}  // namespace meshsmooth::detail
