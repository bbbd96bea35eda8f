#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "meshsmooth/vec3.hpp"

/// The choices that the paper compares: two iteration forms, three data layouts,
/// one thread block or many. Twelve variants.
namespace meshsmooth::bench {

enum class IterationForm {
  a,  // read one array, write another
  b,  // in place, racing
};

enum class Layout {
  aos,          // x y z, 12 B a node
  aos_aligned,  // x y z and 4 B of padding, aligned to 16 B
  soa,          // all x, all y, all z
};

struct Variant {
  IterationForm form = IterationForm::a;
  Layout layout = Layout::aos;
  int block_count = 1;
};

inline constexpr std::array<IterationForm, 2> kForms = {IterationForm::a, IterationForm::b};
inline constexpr std::array<Layout, 3> kLayouts = {Layout::aos, Layout::aos_aligned, Layout::soa};

[[nodiscard]] constexpr std::string_view name_of(IterationForm form) {
  return form == IterationForm::a ? "A" : "B";
}
[[nodiscard]] constexpr std::string_view name_of(Layout layout) {
  return layout == Layout::aos ? "AoS" : layout == Layout::aos_aligned ? "aligned AoS" : "SoA";
}

/// Floats that a node takes in a layout.
[[nodiscard]] constexpr std::size_t floats_of(Layout layout) {
  return layout == Layout::aos_aligned ? 4 : 3;
}

/// Where coordinate `axis` of a node lies in the array of a layout.
[[nodiscard]] constexpr std::size_t float_index(Layout layout, std::size_t node_count,
                                                std::size_t node, std::size_t axis) {
  return layout == Layout::soa ? axis * node_count + node : node * floats_of(layout) + axis;
}

}  // namespace meshsmooth::bench
