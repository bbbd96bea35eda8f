#pragma once

#include <string>
#include <string_view>

namespace meshsmooth::formats {

/// The text of a NASTRAN file whose cards of volume elements have marks ("+") where they go on in
/// the next line. NASTRAN needs none, but Gmsh takes an element without them for a linear one.
/// O(text).
[[nodiscard]] std::string mark_continuations(std::string_view text);

}  // namespace meshsmooth::formats
