#include "report/scene.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "report/encoding.hpp"

namespace meshsmooth::cli {
namespace {

/// Brings the mesh into [-1, 1]: its coordinates may be beyond float, or far from 0.
class Frame {
 public:
  explicit Frame(const DrawnMesh& mesh) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Vec3d lower{kInfinity, kInfinity, kInfinity}, upper{-kInfinity, -kInfinity, -kInfinity};
    for (const ElementBlockView& block : mesh.topology.blocks) {
      for (const NodeId node : block.nodes) {
        const Vec3d p = position_of(mesh.positions, node);
        lower = {std::min(lower.x, p.x), std::min(lower.y, p.y), std::min(lower.z, p.z)};
        upper = {std::max(upper.x, p.x), std::max(upper.y, p.y), std::max(upper.z, p.z)};
      }
    }
    center_ = 0.5 * lower + 0.5 * upper;
    half_ = 0.5 * upper - 0.5 * lower;
    scale_ = std::max({half_.x, half_.y, half_.z});
    if (!(scale_ > 0)) scale_ = 1;
  }
  [[nodiscard]] Vec3f operator()(Vec3d p) const {
    const Vec3d offset = p - center_;
    return vec3_cast<float>(Vec3d{offset.x / scale_, offset.y / scale_, offset.z / scale_});
  }
  [[nodiscard]] std::string json() const {
    const auto vector = [](Vec3d v) {
      return fmt::format("[{},{},{}]", json_number(v.x), json_number(v.y), json_number(v.z));
    };
    return fmt::format(R"("centre":{},"scale":{},"half":{})", vector(center_), json_number(scale_),
                       vector({half_.x / scale_, half_.y / scale_, half_.z / scale_}));
  }

 private:
  Vec3d center_{}, half_{};
  double scale_ = 1;
};

/// Positions after and, unless they are the same, before.
std::string positions_json(const DrawnMesh& mesh, const Frame& frame,
                           std::span<const NodeId> nodes) {
  std::vector<Vec3f> after, before;
  for (const NodeId node : nodes) {
    after.push_back(frame(position_of(mesh.positions, node)));
    if (mesh.before) before.push_back(frame(position_of(*mesh.before, node)));
  }
  std::string json = R"("after":)" + json_array(after);
  if (mesh.before && before != after) json += R"(,"before":)" + json_array(before);
  return json;
}

/// Ids of a file: 4 B each where they fit, 8 B where not.
std::string ids_json(const char* name, const std::vector<std::int64_t>& ids) {
  const auto fits = [](std::int64_t id) {
    return id >= 0 && id <= std::numeric_limits<std::uint32_t>::max();
  };
  if (!std::ranges::all_of(ids, fits)) return fmt::format(R"("{}64":{})", name, json_array(ids));
  return fmt::format(R"("{}":{})", name,
                     json_array(std::vector<std::uint32_t>(ids.begin(), ids.end())));
}

/// Bytes that a surface takes in base64, at most.
std::size_t encoded_size(const Surface& surface) {
  constexpr std::size_t kNode = 2 * sizeof(Vec3f), kTriangle = 12 + 8 + 3;
  return (surface.nodes.size() * kNode + surface.triangles.size() * kTriangle) * 4 / 3;
}

/// As much of the surface as a report may hold.
Surface fit_surface(const DrawnMesh& mesh) {
  const Surface whole = find_surface(mesh.topology);
  const auto too_large = [](const Surface& surface) {
    return surface.triangles.size() > kMostShownTriangles ||
           encoded_size(surface) > 60 * surface.triangles.size() + 400'000;
  };
  if (!too_large(whole)) return whole;
  std::vector<Vec3d> positions;
  for (const NodeId node : whole.nodes) positions.push_back(position_of(mesh.positions, node));
  for (int cells = 1024;; cells = cells * 3 / 4) {
    Surface surface = simplify(whole, positions, cells);
    if (!too_large(surface) || cells < 4) return surface;
  }
}

std::string surface_json(const DrawnMesh& mesh, const Frame& frame, const Surface& surface,
                         std::span<const float> quality, std::span<const float> quality_before,
                         const FileIds& ids) {
  std::vector<std::array<std::uint32_t, 3>> corners;
  std::vector<std::uint8_t> edges;
  std::vector<std::int64_t> elements;
  std::vector<std::int8_t> after, before;  // mean ratio, in 1/127
  const auto packed = [](float ratio) {
    return static_cast<std::int8_t>(std::lround(127 * std::clamp(ratio, -1.F, 1.F)));
  };
  for (const Surface::Triangle& triangle : surface.triangles) {
    corners.push_back(triangle.corners);
    edges.push_back(triangle.edges);
    elements.push_back(ids.element(triangle.element));
    after.push_back(packed(quality[triangle.element]));
    if (mesh.before) before.push_back(packed(quality_before[triangle.element]));
  }
  std::string json =
      fmt::format(R"({{{},{},"corners":{},"edges":{},"qualityAfter":{})",
                  positions_json(mesh, frame, surface.nodes), ids_json("ids", elements),
                  json_array(corners), json_array(edges), json_array(after));
  if (mesh.before) json += R"(,"qualityBefore":)" + json_array(before);
  return json + "}";
}

std::string elements_json(const DrawnMesh& mesh, const Frame& frame,
                          std::span<const ShownElement> elements, const FileIds& ids) {
  std::unordered_map<NodeId, std::uint32_t> index;
  std::vector<NodeId> nodes;
  std::vector<std::uint32_t> connectivity;
  std::vector<std::uint8_t> types, marks;
  std::vector<std::int64_t> element_ids, node_ids;
  std::vector<std::array<float, 4>> quality;
  for (const ShownElement& shown : elements) {
    for (int n = 0; n < element_shape(shown.type).node_count; ++n) {
      const auto [found, added] =
          index.try_emplace(shown.nodes[n], static_cast<std::uint32_t>(nodes.size()));
      if (added) nodes.push_back(shown.nodes[n]);
      connectivity.push_back(found->second);
    }
    types.push_back(static_cast<std::uint8_t>(linear_type(shown.type)));
    // Bits that page.js knows: states come after the marks.
    marks.push_back(static_cast<std::uint8_t>(
        shown.marks | shown.before.inverted << 3 | shown.measure.inverted << 4 |
        shown.before.degenerate << 5 | shown.measure.degenerate << 6));
    element_ids.push_back(ids.element(static_cast<std::int64_t>(shown.element)));
    quality.push_back({static_cast<float>(shown.before.mean_ratio),
                       static_cast<float>(shown.measure.mean_ratio),
                       static_cast<float>(shown.before.scaled_jacobian),
                       static_cast<float>(shown.measure.scaled_jacobian)});
  }
  for (const NodeId node : nodes) node_ids.push_back(ids.node(node));
  return fmt::format(R"({{{},{},{},"nodes":{},"types":{},"marks":{},"quality":{}}})",
                     positions_json(mesh, frame, nodes), ids_json("ids", element_ids),
                     ids_json("nodeIds", node_ids), json_array(connectivity), json_array(types),
                     json_array(marks), json_array(quality));
}

/// Name and facets of every element type; a surface element is its own facet.
std::string types_json() {
  std::string json = "[";
  for (const ElementType type : kLinearTypes) {
    const ElementShape& shape = element_shape(type);
    std::vector<std::vector<int>> facets;
    if (shape.dimension == 2) {
      facets.emplace_back();
      for (int n = 0; n < shape.node_count; ++n) facets.back().push_back(n);
    } else {
      for (int f = 0; f < shape.facet_count; ++f) {
        const auto& nodes = shape.facets[f].nodes;
        facets.emplace_back(nodes.begin(), nodes.begin() + shape.facets[f].node_count);
      }
    }
    std::string list;
    for (const auto& facet : facets) {
      list += fmt::format("{}[{}]", list.empty() ? "" : ",", fmt::join(facet, ","));
    }
    json +=
        fmt::format(R"({}{{"name":{},"nodeCount":{},"facets":[{}]}})", json.size() > 1 ? "," : "",
                    json_string(shape.name), shape.node_count, list);
  }
  return json + "]";
}

}  // namespace

Scene make_scene(const DrawnMesh& mesh, std::span<const ShownElement> elements,
                 const FileIds& ids) {
  const Frame frame(mesh);
  const auto mean_ratios = [&](const PositionsView& positions) {
    return measure_elements(mesh.topology, positions, mesh.orientation, {QualityMetric::mean_ratio})
        .values;
  };
  const std::vector<float> quality = mean_ratios(mesh.positions);
  const std::vector<float> before = mesh.before ? mean_ratios(*mesh.before) : std::vector<float>();

  const Surface surface = fit_surface(mesh);
  Scene scene{.triangle_count = surface.triangles.size(),
              .whole_triangle_count = surface.whole_count};
  const int dimension = element_shape(mesh.topology.blocks.front().type).dimension;
  scene.json =
      fmt::format(R"({{{},"dimension":{},"hasBefore":{},"types":{},"surface":{},"elements":{}}})",
                  frame.json(), dimension, mesh.before.has_value(), types_json(),
                  surface_json(mesh, frame, surface, quality, before, ids),
                  elements_json(mesh, frame, elements, ids));
  return scene;
}

}  // namespace meshsmooth::cli
