#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "cells.hpp"
#include "content.hpp"
#include "readers.hpp"
#include "stl_facets.hpp"
#include "vtk/number_text.hpp"

namespace meshsmooth::formats {
namespace {

constexpr const char* kDegenerateFacet = "degenerate facet";

// VTK's reader drops facets of which two vertices are the same, and its writer all that the file
// has besides triangles.

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
  std::array<std::int64_t, 3> nodes_of(const StlFacet& facet) {
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
  const bool text = is_stl_text(bytes);
  Nodes nodes;
  std::string result;
  result.reserve(bytes.size() + bytes.size() / 4);
  std::size_t copied = 0;
  for_each_stl_facet(path, bytes, [&](const StlFacet& facet) {
    const auto corners = nodes.nodes_of(facet);
    StlFacet moved = facet;
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
      const auto value_of = [&](const StlFacet& of) {
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
  bytes.resize(kStlHeaderBytes, ' ');
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
  for_each_stl_facet(path, content.text, [&](const StlFacet& facet) {
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
