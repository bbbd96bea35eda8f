#include "paper/serial.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace meshsmooth::bench {
namespace {

using Face = std::array<NodeId, 3>;

bool stays(const Rings& rings, const std::vector<std::uint8_t>& boundary, std::size_t node) {
  return boundary[node] != 0 || rings.starts[node] == rings.starts[node + 1];
}

Vec3f mean_of_ring(const Rings& rings, std::size_t node, std::span<const Vec3f> positions) {
  Vec3f sum = {0, 0, 0};
  const auto ring = rings.of(node);
  for (const NodeId neighbour : ring) sum += positions[static_cast<std::size_t>(neighbour)];
  const auto degree = static_cast<float>(ring.size());
  return {sum.x / degree, sum.y / degree, sum.z / degree};
}

}  // namespace

Rings find_neighbours_serial(std::size_t node_count, std::span<const NodeId> tetrahedra) {
  std::vector<std::vector<NodeId>> found(node_count);
  for (std::size_t first = 0; first < tetrahedra.size(); first += 4) {
    const auto corners = tetrahedra.subspan(first, 4);
    for (const NodeId node : corners) {
      auto& ring = found[static_cast<std::size_t>(node)];
      for (const NodeId other : corners) {
        if (other != node && std::find(ring.begin(), ring.end(), other) == ring.end()) {
          ring.push_back(other);
        }
      }
    }
  }
  Rings rings;
  rings.starts.push_back(0);
  for (auto& ring : found) {
    std::sort(ring.begin(), ring.end());
    rings.entries.insert(rings.entries.end(), ring.begin(), ring.end());
    rings.starts.push_back(static_cast<std::int32_t>(rings.entries.size()));
  }
  return rings;
}

std::vector<std::uint8_t> find_boundary_serial(std::size_t node_count,
                                               std::span<const NodeId> tetrahedra) {
  std::vector<Face> faces;
  faces.reserve(tetrahedra.size());
  for (std::size_t first = 0; first < tetrahedra.size(); first += 4) {
    const auto corners = tetrahedra.subspan(first, 4);
    for (std::size_t left_out = 0; left_out < 4; ++left_out) {
      Face face = {corners[(left_out + 1) % 4], corners[(left_out + 2) % 4],
                   corners[(left_out + 3) % 4]};
      std::sort(face.begin(), face.end());
      faces.push_back(face);
    }
  }
  std::sort(faces.begin(), faces.end());
  std::vector<std::uint8_t> boundary(node_count);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const bool again =
        (f > 0 && faces[f - 1] == faces[f]) || (f + 1 < faces.size() && faces[f + 1] == faces[f]);
    if (again) continue;
    for (const NodeId node : faces[f]) boundary[static_cast<std::size_t>(node)] = 1;
  }
  return boundary;
}

SerialResult smooth_form_a(const Rings& rings, const std::vector<std::uint8_t>& boundary,
                           std::vector<Vec3f> positions, float tolerance, int most_sweeps) {
  std::vector<Vec3f> next = positions;
  SerialResult result;
  bool moved = true;
  while (moved && result.sweep_count < most_sweeps) {
    moved = false;
    for (std::size_t node = 0; node < positions.size(); ++node) {
      if (stays(rings, boundary, node)) continue;
      next[node] = mean_of_ring(rings, node, positions);
      const Vec3f move = next[node] - positions[node];
      if (dot(move, move) > tolerance * tolerance) moved = true;
    }
    positions.swap(next);
    ++result.sweep_count;
  }
  result.positions = std::move(positions);
  return result;
}

SerialResult smooth_form_b(const Rings& rings, const std::vector<std::uint8_t>& boundary,
                           std::vector<Vec3f> positions, float tolerance, int most_sweeps) {
  SerialResult result;
  bool moved = true;
  while (moved && result.sweep_count < most_sweeps) {
    moved = false;
    for (std::size_t node = 0; node < positions.size(); ++node) {
      if (stays(rings, boundary, node)) continue;
      const Vec3f place = mean_of_ring(rings, node, positions);
      const Vec3f move = place - positions[node];
      positions[node] = place;
      if (dot(move, move) > tolerance * tolerance) moved = true;
    }
    ++result.sweep_count;
  }
  result.positions = std::move(positions);
  return result;
}

double largest_move(const Rings& rings, const std::vector<std::uint8_t>& boundary,
                    std::span<const Vec3f> positions) {
  double largest = 0;
  for (std::size_t node = 0; node < positions.size(); ++node) {
    if (stays(rings, boundary, node)) continue;
    Vec3d sum = {0, 0, 0};
    const auto ring = rings.of(node);
    for (const NodeId neighbour : ring) {
      sum += vec3_cast<double>(positions[static_cast<std::size_t>(neighbour)]);
    }
    const Vec3d mean = (1.0 / static_cast<double>(ring.size())) * sum;
    largest = std::max(largest, norm(mean - vec3_cast<double>(positions[node])));
  }
  return largest;
}

double largest_difference(std::span<const Vec3f> a, std::span<const Vec3f> b) {
  double largest = 0;
  for (std::size_t node = 0; node < a.size(); ++node) {
    const double distance = norm(vec3_cast<double>(a[node]) - vec3_cast<double>(b[node]));
    // A NaN is no small difference.
    if (!(distance <= largest)) largest = distance;
    if (std::isnan(largest)) return largest;
  }
  return largest;
}

}  // namespace meshsmooth::bench
