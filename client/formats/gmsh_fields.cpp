#include "gmsh_fields.hpp"

#include <algorithm>
#include <array>

#include "msh/msh_content.hpp"
#include "readers.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// Parts of a line between commas; eight of them, missing ones empty.
std::array<std::string_view, 8> split_commas(std::string_view line) {
  std::array<std::string_view, 8> parts;
  for (std::string_view& part : parts) {
    const std::size_t comma = std::min(line.find(','), line.size());
    part = line.substr(0, comma);
    line.remove_prefix(std::min(comma + 1, line.size()));
  }
  return parts;
}

/// Abaqus: "*NODE" and lines "id, x, y, z". Only what Gmsh has just written.
CoordinateFields find_in_inp(const path& file, std::string_view text) {
  CoordinateFields found;
  Scanner scanner(file, text);
  bool inside = false;
  while (!scanner.at_end()) {
    const std::string_view line = scanner.line();
    if (line.starts_with('*')) {
      inside = line.starts_with("*NODE");
    } else if (inside) {
      auto words = split_commas(line);
      for (std::string_view& word : words) {
        word.remove_prefix(std::min(word.find_first_not_of(' '), word.size()));
      }
      const auto id = scanner.parse<std::int64_t>(words[0]);
      found.add(id, {words[1], words[2], words[3]}, scanner);
    }
  }
  return found;
}

}  // namespace

CoordinateFields find_coordinates(const path& file, std::string_view text) {
  const std::string extension = extension_of(file);
  if (extension == ".msh") return find_msh_coordinates(file, text);
  if (extension == ".inp") return find_in_inp(file, text);
  fail("FORMAT_UNKNOWN", file, "not one of Gmsh's formats");
}

}  // namespace meshsmooth::formats
