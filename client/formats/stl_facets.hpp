#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string_view>

#include "meshsmooth/vec3.hpp"

namespace meshsmooth::formats {

/// What a binary STL file begins with, before the number of its facets.
inline constexpr std::size_t kStlHeaderBytes = 80;

/// The normal and three vertices, and where their twelve numbers stand.
struct StlFacet {
  std::array<std::string_view, 12> words;
  std::array<Vec3f, 4> vectors;

  [[nodiscard]] std::span<const Vec3f, 3> vertices() const {
    return std::span(vectors).subspan<1, 3>();
  }
  void set(std::size_t number, std::string_view word, float value) {
    words[number] = word;
    Vec3f& vector = vectors[number / 3];
    (number % 3 == 0 ? vector.x : number % 3 == 1 ? vector.y : vector.z) = value;
  }
};

using StlFacetVisitor = std::function<void(const StlFacet&)>;

/// Whether a file is text; the header of a binary one may begin as text does.
[[nodiscard]] bool is_stl_text(std::string_view bytes);

/// Visits the facets of a file of text, of all its solids, or of a binary one. Throws FORMAT_ERROR,
/// FILE_TRUNCATED.
/// @param path for errors
void for_each_stl_facet(const std::filesystem::path& path, std::string_view bytes,
                        const StlFacetVisitor& visit);

}  // namespace meshsmooth::formats
