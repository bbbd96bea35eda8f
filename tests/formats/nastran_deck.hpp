#pragma once

#include <string>
#include <utility>

#include "mesh_file.hpp"
#include "named_sets.hpp"

namespace meshsmooth::formats::test {

inline const std::string kGrids =
    "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\n";

/// Four triangles in a square; the line of the node in their middle is short.
inline const std::string kFan =
    "GRID    1               0.      0.      0.\n"
    "GRID    2               1.      0.      0.\n"
    "GRID    3               1.      1.      0.\n"
    "GRID    4               0.      1.      0.\n"
    "GRID    5               .31     .64     .1\n"
    "CTRIA3  1       1       1       2       5\n"
    "CTRIA3  2       1       2       3       5\n"
    "CTRIA3  3       1       3       4       5\n"
    "CTRIA3  4       1       4       1       5\n";

/// The same, each triangle with a property of its own.
inline std::string fan_of_properties() {
  std::string text = kFan;
  for (const char number : {'2', '3', '4'}) {
    const std::string before = std::string("CTRIA3  ") + number + "       ";
    text.replace(text.find(before), before.size() + 1, before + number);
  }
  return text;
}

/// Of a tetrahedron of second order.
inline std::string ten_grids() {
  return kGrids +
         "GRID,5,,.5,0.,0.\nGRID,6,,.5,.5,0.\nGRID,7,,0.,.5,0.\nGRID,8,,0.,0.,.5\n"
         "GRID,9,,.5,0.,.5\nGRID,10,,0.,.5,.5\n";
}

inline std::string with_crlf(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '\n' ? "\r\n" : std::string(1, c);
  return result;
}

inline const std::vector<Vec3d>& nodes_of(const MeshFile& file) {
  return std::get<std::vector<Vec3d>>(file.mesh.positions);
}

class NastranTest : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text, const std::string& name = "in.bdf") const {
    put_bytes(scratch_.path(name), text);
    return read_mesh_file(scratch_.path(name));
  }
  [[nodiscard]] std::pair<std::string, std::string> error(const std::string& text) const {
    return error_of([&] { static_cast<void>(read(text)); });
  }
  [[nodiscard]] std::string written(const MeshFile& file,
                                    const std::string& name = "out.bdf") const {
    write_mesh_file(scratch_.path(name), file);
    return bytes_of(scratch_.path(name));
  }

  const Scratch scratch_;
};

}  // namespace meshsmooth::formats::test
