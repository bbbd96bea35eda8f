#include "gmsh_fields.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "readers.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;
using Words = std::array<std::string_view, 3>;

Words next_words(Scanner& scanner) {
  const std::string_view x = scanner.token();
  const std::string_view y = scanner.token();
  return {x, y, scanner.token()};
}

Words next_doubles(Scanner& scanner) {
  const std::string_view bytes = scanner.bytes(3 * sizeof(double));
  return {bytes.substr(0, 8), bytes.substr(8, 8), bytes.substr(16, 8)};
}

template <class T>
T binary(Scanner& scanner) {
  T value{};
  std::memcpy(&value, scanner.bytes(sizeof value).data(), sizeof value);
  return value;
}

// --- .msh --------------------------------------------------------------------

/// $Nodes of MSH 2: "tag x y z", or int32 and three doubles.
void find_msh2(Scanner& scanner, bool is_binary, CoordinateFields& found) {
  const std::size_t count = scanner.count();
  scanner.line();
  for (std::size_t node = 0; node < count; ++node) {
    if (is_binary) {
      const auto tag = binary<std::int32_t>(scanner);
      found.add(tag, next_doubles(scanner), scanner);
    } else {
      const auto tag = scanner.number<std::int64_t>();
      found.add(tag, next_words(scanner), scanner);
      scanner.line();
    }
  }
}

/// One block of MSH 4.1: its tags, then its coordinates.
void find_msh4_block(Scanner& scanner, bool is_binary, std::size_t count, int parameters,
                     CoordinateFields& found) {
  std::vector<std::int64_t> tags;
  for (std::size_t node = 0; node < count; ++node) {
    tags.push_back(is_binary ? static_cast<std::int64_t>(binary<std::size_t>(scanner))
                             : scanner.number<std::int64_t>());
  }
  for (const std::int64_t tag : tags) {
    found.add(tag, is_binary ? next_doubles(scanner) : next_words(scanner), scanner);
    for (int extra = 0; extra < parameters; ++extra) {
      if (is_binary) {
        scanner.bytes(sizeof(double));
      } else {
        scanner.token();
      }
    }
  }
}

/// $Nodes of MSH 4.1: blocks by entity.
void find_msh4(const path& file, Scanner& scanner, bool is_binary, CoordinateFields& found) {
  std::size_t blocks = 0;
  if (is_binary) {
    scanner.line();
    blocks = binary<std::size_t>(scanner);
    scanner.bytes(3 * sizeof(std::size_t));
  } else {
    blocks = scanner.count();
    for (int skipped = 0; skipped < 3; ++skipped) scanner.count();
  }
  for (std::size_t block = 0; block < blocks; ++block) {
    const int dimension = is_binary ? binary<std::int32_t>(scanner) : scanner.number<int>();
    if (is_binary) {
      scanner.bytes(sizeof(std::int32_t));
    } else {
      scanner.token();
    }
    const int parametric = is_binary ? binary<std::int32_t>(scanner) : scanner.number<int>();
    const std::size_t count = is_binary ? binary<std::size_t>(scanner) : scanner.count();
    if (dimension < 0 || dimension > 3) fail("FORMAT_ERROR", file, "an entity of no dimension");
    find_msh4_block(scanner, is_binary, count, parametric != 0 ? dimension : 0, found);
  }
}

CoordinateFields find_in_msh(const path& file, std::string_view text) {
  CoordinateFields found;
  Scanner scanner(file, text);
  if (const auto word = scanner.token(); word != "$MeshFormat") scanner.refuse("$MeshFormat", word);
  const std::string_view version = scanner.token();
  const bool is_binary = scanner.number<int>() == 1;
  if (version != "2.2" && version != "2" && version != "2.1" && version != "4.1") {
    fail("FORMAT_ERROR", file,
         "MSH version " + std::string(version) + " is not supported; 2.2 and 4.1 are");
  }
  if (is_binary) found.style = NumberStyle::binary;

  const std::size_t section = text.find("\n$Nodes");
  const std::size_t elements = text.find("\n$Elements");
  if (section == std::string_view::npos || elements == std::string_view::npos) {
    fail(text.find("$EndMeshFormat") == std::string_view::npos ||
                 section == std::string_view::npos ||
                 text.rfind("$EndNodes") == std::string_view::npos
             ? "FILE_TRUNCATED"
             : "MESH_EMPTY",
         file,
         section == std::string_view::npos ? "there is no $Nodes section"
                                           : "there is no $Elements section");
  }
  if (text.find("\n$EndElements", elements) == std::string_view::npos) {
    fail("FILE_TRUNCATED", file, "there is no $EndElements");
  }
  Scanner nodes(file, text);
  nodes.bytes(section + 1);
  nodes.token();
  if (version.starts_with('2')) {
    find_msh2(nodes, is_binary, found);
  } else {
    find_msh4(file, nodes, is_binary, found);
  }
  if (const auto word = nodes.token(); word != "$EndNodes") nodes.refuse("$EndNodes", word);
  return found;
}

// --- the others --------------------------------------------------------------

constexpr auto kNotRead = std::to_array<std::string_view>(
    {"Prisms", "Pyramids", "TrianglesP2", "QuadrilateralsQ2", "TetrahedraP2", "HexahedraQ2"});

/// MEDIT: "Vertices", a count, "x y z reference".
CoordinateFields find_in_mesh(const path& file, std::string_view text) {
  CoordinateFields found;
  Scanner scanner(file, text, '#');
  if (const auto word = scanner.token(); word != "MeshVersionFormatted") {
    scanner.refuse("MeshVersionFormatted", word);
  }
  bool finished = false;
  while (!scanner.at_end() && !finished) {
    const std::string_view keyword = scanner.token();
    finished = keyword == "End";
    if (std::find(kNotRead.begin(), kNotRead.end(), keyword) != kNotRead.end() &&
        scanner.count() > 0) {
      fail("ELEMENT_NOT_SUPPORTED", file,
           "Gmsh does not read " + std::string(keyword) + " from MEDIT files");
    }
    if (keyword == "Dimension") {
      if (const auto word = scanner.token(); word != "3") scanner.refuse("dimension 3", word);
    }
    if (keyword != "Vertices") continue;
    const std::size_t count = scanner.count();
    for (std::size_t node = 0; node < count; ++node) {
      found.add(static_cast<std::int64_t>(node) + 1, next_words(scanner), scanner);
      scanner.token();
    }
  }
  if (!finished) fail("FILE_TRUNCATED", file, "there is no End");
  return found;
}

/// With the blanks before each number, but for one, so that there is room for a sign in its
/// columns.
Words with_blanks(std::string_view text, Words words) {
  constexpr std::size_t kColumns = 25;
  for (std::string_view& word : words) {
    auto begin = static_cast<std::size_t>(word.data() - text.data());
    const std::size_t end = begin + word.size();
    while (begin > 1 && end - begin < kColumns && text[begin - 1] == ' ' &&
           text[begin - 2] == ' ') {
      --begin;
    }
    word = text.substr(begin, end - begin);
  }
  return words;
}

/// UNV: data set 2411, "label … …" and three numbers of 25 columns.
CoordinateFields find_in_unv(const path& file, std::string_view text) {
  CoordinateFields found;
  found.style = NumberStyle::fortran;
  Scanner scanner(file, text);
  int data_sets = 0;
  while (!scanner.at_end()) {
    if (const auto mark = scanner.token(); mark != "-1") scanner.refuse("-1", mark);
    const std::string_view number = scanner.token();
    scanner.line();
    ++data_sets;
    while (true) {
      if (scanner.at_end()) scanner.truncated();
      const std::string_view first = scanner.token();
      if (first == "-1") break;
      scanner.line();
      if (number != "2411" && number != "781") continue;
      const auto id = scanner.parse<std::int64_t>(first);
      found.add(id, with_blanks(text, next_words(scanner)), scanner);
      scanner.line();
    }
    scanner.line();
  }
  if (data_sets == 0) scanner.refuse("-1", "");
  return found;
}

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

/// NASTRAN: GRID cards in fields of 8 or (GRID*) 16 columns, or with commas.
CoordinateFields find_in_bdf(const path& file, std::string_view text) {
  CoordinateFields found;
  found.style = NumberStyle::nastran;
  Scanner scanner(file, text);
  while (!scanner.at_end()) {
    const std::string_view line = scanner.line();
    if (!line.starts_with("GRID")) continue;
    const auto column = [&](std::string_view card, std::size_t first, std::size_t width) {
      if (card.size() <= first) scanner.refuse("three coordinates", card);
      return card.substr(first, width);
    };
    std::array<std::string_view, 5> words{};  // number, coordinate system, x, y, z
    if (line.substr(0, 8).find(',') != std::string_view::npos) {
      const auto parts = split_commas(line);
      std::copy_n(parts.begin() + 1, words.size(), words.begin());
      if (words[4].empty()) scanner.refuse("three coordinates", line);
    } else if (line.starts_with("GRID*")) {
      const std::string_view next = scanner.line();
      words = {column(line, 8, 16), column(line, 24, 16), column(line, 40, 16),
               column(line, 56, 16), column(next, 8, 16)};
    } else {
      words = {column(line, 8, 8), column(line, 16, 8), column(line, 24, 8), column(line, 32, 8),
               column(line, 40, 8)};
    }
    const auto bare = [](std::string_view word) {
      word.remove_prefix(std::min(word.find_first_not_of(' '), word.size()));
      return word.substr(0, word.find(' '));
    };
    if (!bare(words[1]).empty() && bare(words[1]) != "0") {
      scanner.refuse("nodes in the basic coordinate system", line);
    }
    const auto id = scanner.parse<std::int64_t>(bare(words[0]));
    found.add(id, {words[2], words[3], words[4]}, scanner);
  }
  return found;
}

}  // namespace

CoordinateFields find_coordinates(const path& file, std::string_view text) {
  const std::string extension = extension_of(file);
  if (extension == ".msh") return find_in_msh(file, text);
  if (extension == ".mesh") return find_in_mesh(file, text);
  if (extension == ".unv") return find_in_unv(file, text);
  if (extension == ".bdf" || extension == ".nas") return find_in_bdf(file, text);
  if (extension == ".inp") return find_in_inp(file, text);
  fail("FORMAT_UNKNOWN", file, "not one of Gmsh's formats");
}

}  // namespace meshsmooth::formats
