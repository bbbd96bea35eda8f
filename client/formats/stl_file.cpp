#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <unordered_map>

#include "cells.hpp"
#include "content.hpp"
#include "readers.hpp"
#include "text.hpp"
#include "vtk/number_text.hpp"

namespace meshsmooth::formats {
namespace {

// VTK's reader drops facets of which two vertices are the same, and its writer all that the file
// has besides triangles.

constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kFacetBytes = 50;
constexpr const char* kDegenerateFacet = "degenerate facet";

/// The normal and three vertices, and where their twelve numbers stand.
struct Facet {
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

bool is_word(std::string_view word, std::string_view keyword) {
  return std::ranges::equal(word, keyword, [](char a, char b) {
    return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b;
  });
}

void expect(Scanner& scanner, std::string_view keyword) {
  if (const auto word = scanner.token(); !is_word(word, keyword)) scanner.refuse(keyword, word);
}

void read_vector(Scanner& scanner, Facet& facet, std::size_t vector) {
  for (std::size_t number = 3 * vector; number < 3 * vector + 3; ++number) {
    const std::string_view word = scanner.token();
    const auto value = parse_number(word, true);
    if (!value) scanner.refuse("a number", word);
    facet.set(number, word, static_cast<float>(*value));
  }
}

Facet read_text_facet(Scanner& scanner) {
  Facet facet;
  expect(scanner, "normal");
  read_vector(scanner, facet, 0);
  expect(scanner, "outer");
  expect(scanner, "loop");
  for (std::size_t vertex = 1; vertex <= 3; ++vertex) {
    expect(scanner, "vertex");
    read_vector(scanner, facet, vertex);
  }
  expect(scanner, "endloop");
  expect(scanner, "endfacet");
  return facet;
}

/// Calls the functor with each facet, of all solids.
template <class Functor>
void for_each_text_facet(const std::filesystem::path& path, std::string_view text,
                         Functor functor) {
  Scanner scanner(path, text);
  bool in_solid = false;
  while (!scanner.at_end()) {
    const std::string_view word = scanner.token();
    if (is_word(word, "solid") || is_word(word, "endsolid")) {
      in_solid = is_word(word, "solid");
      scanner.line();  // with its name
    } else if (is_word(word, "color")) {
      scanner.line();
    } else if (is_word(word, "facet")) {
      functor(read_text_facet(scanner));
    } else {
      scanner.refuse("facet or endsolid", word);
    }
  }
  if (in_solid) fail("FILE_TRUNCATED", path, "there is no endsolid");
}

std::uint32_t facet_count(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kHeaderBytes, sizeof count);
  return count;
}

void check_binary(const std::filesystem::path& path, std::string_view bytes) {
  const std::size_t start = kHeaderBytes + sizeof(std::uint32_t);
  if (bytes.size() < start) fail("FORMAT_ERROR", path, "this is no STL file");
  const std::size_t count = facet_count(bytes);
  const std::size_t expected = start + kFacetBytes * count;
  if (bytes.size() < expected) {
    fail("FILE_TRUNCATED", path,
         "it should hold " + std::to_string(count) + " triangles, " + std::to_string(expected) +
             " bytes, but has " + std::to_string(bytes.size()));
  }
  constexpr std::size_t kMostBehind = 4096;
  const std::size_t behind = bytes.size() - expected;
  if (behind > kMostBehind) fail("FORMAT_ERROR", path, "this is no STL file");
  if (behind == 0 || behind % kFacetBytes != 0) return;
  fail("FORMAT_ERROR", path,
       "it announces " + std::to_string(count) + " triangles, but has room for " +
           std::to_string(count + behind / kFacetBytes));
}

bool is_text(std::string_view bytes) {
  const std::size_t first = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
  const std::string_view start = bytes.substr(first, 5);
  if (!is_word(start, "solid")) return false;
  // The header of a binary file may begin so, too.
  constexpr std::size_t kStart = kHeaderBytes + sizeof(std::uint32_t);
  if (bytes.size() >= kStart && bytes.size() == kStart + kFacetBytes * facet_count(bytes)) {
    return false;
  }
  return bytes.find("facet") != std::string_view::npos ||
         bytes.find("FACET") != std::string_view::npos;
}

template <class Functor>
void for_each_facet(const std::filesystem::path& path, std::string_view bytes, Functor functor) {
  if (is_text(bytes)) return for_each_text_facet(path, bytes, functor);
  check_binary(path, bytes);
  for (std::size_t row = 0; row < facet_count(bytes); ++row) {
    const std::size_t begin = kHeaderBytes + sizeof(std::uint32_t) + row * kFacetBytes;
    Facet facet;
    for (std::size_t number = 0; number < facet.words.size(); ++number) {
      const std::string_view word = bytes.substr(begin + number * sizeof(float), sizeof(float));
      float value = 0;
      std::memcpy(&value, word.data(), sizeof value);
      facet.set(number, word, value);
    }
    functor(facet);
  }
}

/// Joins vertices that have the same coordinates, in the order in which they come up.
class Nodes {
 public:
  std::int64_t node_at(const Vec3f& place) {
    // -0 is 0.
    const Key key = {std::bit_cast<std::uint32_t>(place.x + 0.0F),
                     std::bit_cast<std::uint32_t>(place.y + 0.0F),
                     std::bit_cast<std::uint32_t>(place.z + 0.0F)};
    const auto [found, is_new] =
        nodes_.try_emplace(key, static_cast<std::int64_t>(positions_.size()));
    if (is_new) positions_.push_back(place);
    return found->second;
  }
  std::array<std::int64_t, 3> nodes_of(const Facet& facet) {
    const auto vertices = facet.vertices();
    const std::int64_t first = node_at(vertices[0]);
    const std::int64_t second = node_at(vertices[1]);
    return {first, second, node_at(vertices[2])};
  }
  [[nodiscard]] std::vector<Vec3f>& positions() { return positions_; }

 private:
  using Key = std::array<std::uint32_t, 3>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t hash = 0;
      for (const std::uint32_t part : key) {
        hash = (hash ^ part) * 0x9e3779b97f4a7c15U;
        hash ^= hash >> 32U;
      }
      return hash;
    }
  };

  std::unordered_map<Key, std::int64_t, Hash> nodes_;
  std::vector<Vec3f> positions_;
};

Vec3f normal_of(std::span<const Vec3f, 3> vertices) {
  const auto a = vec3_cast<double>(vertices[1]) - vec3_cast<double>(vertices[0]);
  const auto b = vec3_cast<double>(vertices[2]) - vec3_cast<double>(vertices[0]);
  const Vec3d normal = cross(a, b);
  const double length = std::sqrt(dot(normal, normal));
  return length > 0 ? vec3_cast<float>((1 / length) * normal) : Vec3f{};
}

std::vector<Vec3f> single_positions(const Mesh& mesh) {
  std::vector<Vec3f> nodes;
  std::visit(
      [&](const auto& all) {
        for (const auto& node : all) nodes.push_back(vec3_cast<float>(node));
      },
      mesh.positions);
  return nodes;
}

/// Also where it is NaN; 0 is -0.
bool is_same(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool is_same(const Vec3f& a, const Vec3f& b) {
  return is_same(a.x, b.x) && is_same(a.y, b.y) && is_same(a.z, b.z);
}

/// The file with other vertices, and the normals of those facets that change. A normal of 0 asks
/// readers to compute it.
std::string moved_stl(const std::filesystem::path& path, std::string_view bytes, const Mesh& mesh) {
  const std::vector<Vec3f> now = single_positions(mesh);
  const bool text = is_text(bytes);
  Nodes nodes;
  std::string result;
  result.reserve(bytes.size() + bytes.size() / 4);
  std::size_t copied = 0;
  for_each_facet(path, bytes, [&](const Facet& facet) {
    const auto corners = nodes.nodes_of(facet);
    Facet moved = facet;
    bool has_moved = false;
    for (std::size_t vertex = 1; vertex <= 3; ++vertex) {
      const Vec3f& to = now[static_cast<std::size_t>(corners[vertex - 1])];
      if (is_same(to, facet.vectors[vertex])) continue;
      moved.vectors[vertex] = to;
      has_moved = true;
    }
    if (!has_moved) return;
    const Vec3f normal = normal_of(moved.vertices());
    if (!(facet.vectors[0] == Vec3f{}) && !(normal == Vec3f{})) moved.vectors[0] = normal;
    for (std::size_t number = 0; number < facet.words.size(); ++number) {
      const auto value_of = [&](const Facet& of) {
        const Vec3f& vector = of.vectors[number / 3];
        return number % 3 == 0 ? vector.x : number % 3 == 1 ? vector.y : vector.z;
      };
      const float value = value_of(moved);
      if (is_same(value, value_of(facet))) continue;
      const auto begin = static_cast<std::size_t>(facet.words[number].data() - bytes.data());
      result += bytes.substr(copied, begin - copied);
      if (text) {
        append_number(result, static_cast<double>(value), true);
      } else {
        result.append(reinterpret_cast<const char*>(&value), sizeof value);
      }
      copied = begin + facet.words[number].size();
    }
  });
  return result += bytes.substr(copied);
}

/// The triangles of the cells: strips have several.
std::vector<std::array<std::int64_t, 3>> triangles_of(const std::filesystem::path& path,
                                                      const Dataset& dataset) {
  std::vector<std::array<std::int64_t, 3>> triangles;
  Cell cell;
  for (std::int64_t id = 0; id < dataset.cell_count(); ++id) {
    dataset.get_cell(id, cell);
    const auto& nodes = cell.nodes;
    if (cell.type == kTriangleStripCell) {
      for (std::size_t first = 0; first + 2 < nodes.size(); ++first) {
        const std::size_t odd = first % 2;  // seen from the other side
        triangles.push_back({nodes[first + odd], nodes[first + 1 - odd], nodes[first + 2]});
      }
      continue;
    }
    const CellKind* kind = find_vtk_cell(cell.type, nodes.size());
    const bool polygon = kind == nullptr && cell.type == kPolygonCell;
    if (polygon ||
        (kind != nullptr && kind->dimension > 1 && kind->element != ElementType::triangle)) {
      fail("ELEMENT_NOT_SUPPORTED", path,
           ".stl files cannot carry a " + (polygon ? "polygon" : std::string(kind->name)));
    }
    if (kind != nullptr && kind->dimension == 2)
      triangles.push_back({nodes[0], nodes[1], nodes[2]});
  }
  return triangles;
}

std::string make_stl(const std::filesystem::path& path, const MeshFile& file) {
  const auto triangles = triangles_of(path, *dataset_of(file));
  const std::vector<Vec3f> positions = single_positions(file.mesh);
  std::string bytes = "binary STL written by meshsmooth";
  bytes.resize(kHeaderBytes, ' ');
  const auto count = static_cast<std::uint32_t>(triangles.size());
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  for (const auto& corners : triangles) {
    std::array<Vec3f, 3> vertices;
    for (std::size_t vertex = 0; vertex < 3; ++vertex) {
      vertices[vertex] = positions[static_cast<std::size_t>(corners[vertex])];
    }
    const Vec3f normal = normal_of(vertices);
    for (const Vec3f& vector : {normal, vertices[0], vertices[1], vertices[2]}) {
      for (const float value : {vector.x, vector.y, vector.z}) {
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
      }
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

}  // namespace

MeshFile read_stl(const std::filesystem::path& path) {
  FileContent content;
  content.extension = ".stl";
  content.text = read_bytes(path);
  const auto dataset = std::make_shared<PlainDataset>();
  Nodes nodes;
  for_each_facet(path, content.text, [&](const Facet& facet) {
    auto corners = nodes.nodes_of(facet);
    if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0]) {
      dataset->add_cell(kTriangleCell, corners);
      return;
    }
    std::ranges::sort(corners);
    const auto behind = std::unique(corners.begin(), corners.end());
    dataset->add_cell(dataset->own_type(kDegenerateFacet), {corners.begin(), behind});
  });
  dataset->set_positions(std::move(nodes.positions()));
  content.dataset = dataset;
  return make_mesh_file(path, std::move(content));
}

void write_stl(const std::filesystem::path& path, const MeshFile& file) {
  const bool own = file.content() && file.content()->extension == ".stl";
  write_bytes(path, own ? moved_stl(path, file.content()->text, file.mesh) : make_stl(path, file));
}

}  // namespace meshsmooth::formats
