#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "report/shown_elements.hpp"
#include "report/surface.hpp"

namespace meshsmooth::cli {

inline constexpr std::size_t kMostShownElements = 5'000;
inline constexpr std::size_t kMostShownTriangles = 200'000;

/// The drawing in a report, for page.js.
struct Scene {
  std::string json = {};  // may stand in a <script> element
  std::size_t triangle_count = 0;
  std::size_t whole_triangle_count = 0;  // of the surface, before it was simplified
};

/// What the file calls elements and nodes.
struct FileIds {
  std::function<std::int64_t(std::int64_t)> element;
  std::function<std::int64_t(std::int64_t)> node;
};

/// Puts the surface and the elements into arrays of base64: at most `kMostShownTriangles` of the
/// surface, at 60 B each and 0.4 MB, and the elements at 0.42 kB.
[[nodiscard]] Scene make_scene(const DrawnMesh& mesh, std::span<const ShownElement> elements,
                               const FileIds& ids);

}  // namespace meshsmooth::cli
