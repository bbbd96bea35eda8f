// Non-orthogonality and skewness of faces by the definitions of OpenFOAM.

#include "mesh/face_metrics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "mesh/parallel.hpp"

namespace meshsmooth::detail {
namespace {

constexpr double kTiny = 1e-150;  // OpenFOAM's ROOTVSMALL

/// A face of an element. Facets of an element are numbered contiguously, those of the elements
/// follow each other.
struct Side {
  std::array<NodeId, kMaxFacetNodes> nodes;  // ascending; those of triangles begin by -1
  std::uint32_t element;
  std::uint32_t facet;  // of the element

  friend auto operator<=>(const Side& a, const Side& b) = default;
};

struct Face {
  std::array<Vec3d, kMaxFacetNodes> nodes;
  std::size_t count = 0;
  Vec3d centre{}, area{};  // the area vector points out of the element
};

/// Area-weighted by the triangles about the mean of the nodes.
void measure(Face& face) {
  Vec3d mean{};
  for (std::size_t n = 0; n < face.count; ++n) mean += face.nodes[n];
  mean = (1.0 / static_cast<double>(face.count)) * mean;
  if (face.count == 3) {
    face.centre = mean;
    face.area = 0.5 * cross(face.nodes[1] - face.nodes[0], face.nodes[2] - face.nodes[0]);
    return;
  }
  Vec3d area{}, weighted{};
  double sum = 0;
  for (std::size_t n = 0; n < face.count; ++n) {
    const Vec3d a = face.nodes[n], b = face.nodes[(n + 1) % face.count];
    const Vec3d normal = cross(b - a, mean - a);
    const double size = norm(normal);
    area += normal;
    sum += size;
    weighted += size * (a + b + mean);
  }
  face.area = 0.5 * area;
  face.centre = sum > kTiny ? (1 / (3 * sum)) * weighted : mean;
}

/// Volume-weighted by the pyramids between the faces and the mean of their centres.
Vec3d cell_centre(std::span<const Face> faces) {
  Vec3d mean{};
  for (const Face& face : faces) mean += face.centre;
  mean = (1.0 / static_cast<double>(faces.size())) * mean;
  Vec3d weighted{};
  double volume = 0;
  for (const Face& face : faces) {
    const double pyramid = dot(face.area, face.centre - mean);
    weighted += pyramid * (0.75 * face.centre + 0.25 * mean);
    volume += pyramid;
  }
  return std::abs(volume) > kTiny * kTiny ? (1 / volume) * weighted : mean;
}

/// Of the point where the line along `d` through `from` meets the face's plane, from its centre,
/// over the extent of the face in this direction.
double skewness(const Face& face, Vec3d from, Vec3d d, double share) {
  const Vec3d to_face = face.centre - from;
  const Vec3d offset = to_face - (dot(face.area, to_face) / (dot(face.area, d) + kTiny)) * d;
  const Vec3d direction = (1 / (norm(offset) + kTiny)) * offset;
  double extent = share * norm(d) + kTiny;
  for (std::size_t n = 0; n < face.count; ++n) {
    extent = std::max(extent, std::abs(dot(direction, face.nodes[n] - face.centre)));
  }
  return norm(offset) / extent;
}

/// The elements of all blocks by their ids.
template <class Real>
class Elements {
 public:
  Elements(const TopologyView& topology, std::span<const Vec3<Real>> positions)
      : topology_(topology), positions_(positions) {
    std::size_t count = 0;
    for (const ElementBlockView& block : topology.blocks) {
      first_.push_back(count);
      count += block.element_count();
    }
    first_.push_back(count);
  }
  [[nodiscard]] std::size_t count() const { return first_.back(); }
  [[nodiscard]] const ElementShape& shape(std::size_t element) const {
    return element_shape(topology_.blocks[block_of(element)].type);
  }
  [[nodiscard]] Side side(std::size_t element, std::size_t facet) const {
    const FacetShape& shape = this->shape(element).facets[facet];
    const NodeId* const nodes = nodes_of(element);
    Side side{
        {-1, -1, -1, -1}, static_cast<std::uint32_t>(element), static_cast<std::uint32_t>(facet)};
    for (std::size_t n = 0; n < static_cast<std::size_t>(shape.node_count); ++n) {
      side.nodes[n] = nodes[shape.nodes[n]];
    }
    std::ranges::sort(side.nodes);
    return side;
  }
  [[nodiscard]] Face face(std::size_t element, std::size_t facet) const {
    const FacetShape& shape = this->shape(element).facets[facet];
    const NodeId* const nodes = nodes_of(element);
    Face face;
    face.count = static_cast<std::size_t>(shape.node_count);
    for (std::size_t n = 0; n < face.count; ++n) {
      face.nodes[n] =
          vec3_cast<double>(positions_[static_cast<std::size_t>(nodes[shape.nodes[n]])]);
    }
    measure(face);
    return face;
  }
  [[nodiscard]] Vec3d centre(std::size_t element) const {
    const auto facet_count = static_cast<std::size_t>(shape(element).facet_count);
    std::array<Face, kMaxElementFacets> faces;
    for (std::size_t f = 0; f < facet_count; ++f) faces[f] = face(element, f);
    return cell_centre(std::span(faces).first(facet_count));
  }

 private:
  [[nodiscard]] std::size_t block_of(std::size_t element) const {
    std::size_t block = 0;
    while (first_[block + 1] <= element) ++block;
    return block;
  }
  [[nodiscard]] const NodeId* nodes_of(std::size_t element) const {
    const std::size_t block = block_of(element);
    const ElementBlockView& view = topology_.blocks[block];
    const auto width = element_width(view.type);
    return view.nodes.data() + (element - first_[block]) * width;
  }

  const TopologyView& topology_;
  std::span<const Vec3<Real>> positions_;
  std::vector<std::size_t> first_;  // ids of the first elements of the blocks, and the end
};

/// All sides, those of one face next to each other, the one of the lower element first.
template <class Real>
std::vector<Side> sorted_sides(const Elements<Real>& elements,
                               const std::vector<std::size_t>& first_side) {
  std::vector<Side> sides(first_side.back());
  parallel_for_ranges(elements.count(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      for (std::size_t s = first_side[e]; s < first_side[e + 1]; ++s) {
        sides[s] = elements.side(e, s - first_side[e]);
      }
    }
  });
  parallel_sort(sides.data(), sides.size());
  return sides;
}

struct CosineSum {
  double cosines = 0, least = 1, skewness = 0;
  std::int64_t count = 0;
};

template <class Real>
FaceMetrics measure_all(const Elements<Real>& elements) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto degrees = [](double cosine) {
    return std::acos(std::clamp(cosine, -1.0, 1.0)) * (180 / 3.14159265358979323846);
  };
  const std::size_t element_count = elements.count();
  std::vector<std::size_t> first_side = {0};
  for (std::size_t e = 0; e < element_count; ++e) {
    first_side.push_back(first_side.back() +
                         static_cast<std::size_t>(elements.shape(e).facet_count));
  }
  std::vector<Vec3d> centres(element_count);
  parallel_for_ranges(element_count, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) centres[e] = elements.centre(e);
  });
  const std::vector<Side> sides = sorted_sides(elements, first_side);

  std::vector<double> cosines(sides.size(), kNaN), skews(sides.size());
  const auto same_face = [&](std::size_t a, std::size_t b) {
    return a < sides.size() && b < sides.size() && sides[a].nodes == sides[b].nodes;
  };
  const auto place_of = [&](const Side& side) { return first_side[side.element] + side.facet; };
  const auto visit_side = [&](std::size_t s) -> CosineSum {
    const Side& own = sides[s];
    const Face face = elements.face(own.element, own.facet);
    const Vec3d centre = centres[own.element];
    const bool first_of_two = same_face(s, s + 1) && !same_face(s, s + 2) && !same_face(s, s - 1);
    const bool second_of_two = same_face(s, s - 1) && !same_face(s, s + 1) && !same_face(s, s - 2);
    if (second_of_two) return {};
    if (!first_of_two) {
      const Vec3d normal = (1 / (norm(face.area) + kTiny)) * face.area;
      const Vec3d d = dot(normal, face.centre - centre) * normal;
      skews[place_of(own)] = skewness(face, centre, d, 0.4);
      return {.skewness = skews[place_of(own)]};
    }
    const Side& other = sides[s + 1];
    const Vec3d d = centres[other.element] - centre;
    const double cosine = dot(d, face.area) / (norm(d) * norm(face.area) + kTiny);
    const double skew = skewness(face, centre, d, 0.2);
    for (const Side* side : {&own, &other}) {
      cosines[place_of(*side)] = cosine;
      skews[place_of(*side)] = skew;
    }
    return {cosine, cosine, skew, 1};
  };
  const CosineSum sum = parallel_reduce(
      sides.size(), CosineSum{}, visit_side, [](const CosineSum& a, const CosineSum& b) {
        return CosineSum{a.cosines + b.cosines, std::min(a.least, b.least),
                         std::max(a.skewness, b.skewness), a.count + b.count};
      });

  FaceMetrics result;
  result.non_orthogonality.assign(element_count, kNaN);
  result.skewness.assign(element_count, 0);
  parallel_for_ranges(element_count, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      for (std::size_t s = first_side[e]; s < first_side[e + 1]; ++s) {
        result.skewness[e] = std::max(result.skewness[e], skews[s]);
        if (std::isnan(cosines[s])) continue;
        result.non_orthogonality[e] = std::fmax(result.non_orthogonality[e], degrees(cosines[s]));
      }
    }
  });
  result.stats.internal_face_count = sum.count;
  result.stats.max_skewness = sum.skewness;
  if (sum.count > 0) {
    result.stats.max_non_orthogonality = degrees(sum.least);
    result.stats.average_non_orthogonality = degrees(sum.cosines / static_cast<double>(sum.count));
  }
  return result;
}

}  // namespace

FaceMetrics measure_faces(const TopologyView& topology, const PositionsView& positions) {
  return std::visit([&](auto span) { return measure_all(Elements(topology, span)); }, positions);
}

}  // namespace meshsmooth::detail
