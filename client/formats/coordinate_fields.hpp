#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "text.hpp"

namespace meshsmooth::formats {

/// How a coordinate is written in a file.
enum class NumberStyle {
  shortest,        // as few digits as give the same bits back
  fortran,         // 1.0000000000000000D+00; right-aligned in a field of 13 or 25 columns
  deck,            // Abaqus: at most 20 characters, right-aligned, with a D where there was one
  binary,          // IEEE, four or eight bytes, little-endian
  binary_swapped,  // the same, big-endian
};

/// Where the coordinates of the nodes stand in the bytes of a file, in the
/// file's order. Putting other numbers there and nothing else is the surest
/// way to give a caller his own file back.
struct CoordinateFields {
  struct Field {
    std::size_t begin;
    std::size_t length;
    bool missing = false;  // the line ends before it: a comma comes first
    // Of Nastran's decks.
    bool in_next_line = false;  // which is missing, too
    std::uint8_t columns = 0;   // of a field of fixed width, even where its line is shorter; or 0
    std::uint8_t lead = 0;      // where missing: columns or commas between the line's end and it
    std::uint8_t digits = 24;  // columns that the number may take: all cards of a node say the same
  };

  NumberStyle style = NumberStyle::shortest;
  std::vector<std::int64_t> node_ids;        // what the file calls the nodes
  std::vector<std::array<Field, 3>> fields;  // x, y, z of each
  std::vector<Vec3d> positions;              // as read

  void add(std::int64_t node_id, std::array<std::string_view, 3> words, const Scanner& scanner);
};

/// The bytes with the positions put in place. A coordinate that equals the one
/// read keeps its very text. O(bytes).
[[nodiscard]] std::string replace_coordinates(std::string_view bytes,
                                              const CoordinateFields& fields,
                                              const PositionsView& positions);

}  // namespace meshsmooth::formats
