#pragma once

#include <string_view>

namespace meshsmooth::formats::medit {

/// What a section of a Medit file is to us.
enum class Role {
  skipped,   // data on entities, geometry
  vertices,  // coordinates and a reference
  cells,     // `node_count` vertices and a reference
  kept,      // numbers of entities of the section `of` that remeshers must not change
  refused,   // elements of which a section tells only a part
};

struct Keyword {
  std::string_view name;
  int code;  // in binary files; 0: it has none
  Role role;
  int node_count = 0;
  int vtk_type = 0;          // 0: such cells cannot be smoothed
  std::string_view of = {};  // empty: vertices
};

inline constexpr int kDimensionCode = 3;
inline constexpr int kVerticesCode = 4;
inline constexpr int kCornersCode = 13;
inline constexpr int kRequiredVerticesCode = 15;
inline constexpr int kEndCode = 54;
inline constexpr int kPrecisionCode = 155;  // bits of a coordinate

/// By its name, in any letter case; null for a section that tells nothing of the mesh.
[[nodiscard]] const Keyword* find_keyword(std::string_view name);
[[nodiscard]] const Keyword* find_keyword(int code);
/// The section that cells of this type are written to; null: there is none.
[[nodiscard]] const Keyword* find_section(int vtk_type);
[[nodiscard]] bool same_word(std::string_view a, std::string_view b);

}  // namespace meshsmooth::formats::medit
