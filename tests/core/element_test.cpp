#include "meshsmooth/element.hpp"

#include <gmock/gmock.h>

#include <map>
#include <set>

#include "meshsmooth/element_geometry.hpp"
#include "support/oracle.hpp"

namespace meshsmooth {
namespace {

class EveryElement : public testing::TestWithParam<ElementType> {
 protected:
  const ElementShape& shape = element_shape(GetParam());
  const std::vector<Vec3d> ideal = test::ideal_points(GetParam());
  const std::function<Vec3d(int)> position = [this](int n) { return ideal[n]; };
  const Vec3d up{0, 0, 1};

  [[nodiscard]] std::set<std::set<int>> edges() const {
    std::set<std::set<int>> result;
    for (int e = 0; e < shape.edge_count; ++e)
      result.insert({shape.edges[e][0], shape.edges[e][1]});
    return result;
  }
  [[nodiscard]] Vec3d centre() const {
    Vec3d sum{0, 0, 0};
    for (const Vec3d& p : ideal) sum += p;
    return (1.0 / static_cast<double>(ideal.size())) * sum;
  }
};

INSTANTIATE_TEST_SUITE_P(ElementTable, EveryElement, testing::ValuesIn(kLinearTypes),
                         [](const auto& param) { return std::string(element_name(param.param)); });

TEST_P(EveryElement, HasTheNodesEdgesAndFacetsOfItsIdealShape) {
  std::set<std::set<int>> facets;
  for (int f = 0; f < shape.facet_count; ++f) {
    const auto& nodes = shape.facets[f].nodes;
    facets.emplace(nodes.begin(), nodes.begin() + shape.facets[f].node_count);
  }

  EXPECT_EQ(shape.node_count, static_cast<int>(ideal.size()));
  EXPECT_EQ(edges(), test::oracle::local_edges(GetParam()));
  EXPECT_EQ(static_cast<int>(edges().size()), shape.edge_count);
  EXPECT_EQ(facets, test::oracle::local_facets(GetParam()));
  EXPECT_EQ(static_cast<int>(facets.size()), shape.facet_count);
}

TEST_P(EveryElement, FacetsWalkAlongEdgesAndClose) {
  // In a solid every edge is walked once each way; the outline of a surface
  // element is walked once.
  std::map<std::pair<int, int>, int> walks;
  for (int f = 0; f < shape.facet_count; ++f) {
    const FacetShape& facet = shape.facets[f];
    const int steps = shape.dimension == 3 ? facet.node_count : 1;
    for (int n = 0; n < steps; ++n) {
      ++walks[{facet.nodes[n], facet.nodes[(n + 1) % facet.node_count]}];
    }
  }

  for (const auto& [walk, count] : walks) {
    EXPECT_EQ(count, 1) << walk.first << "-" << walk.second;
    EXPECT_TRUE(edges().contains({walk.first, walk.second}));
    if (shape.dimension == 3) {
      EXPECT_TRUE(walks.contains({walk.second, walk.first}));
    }
  }
  EXPECT_EQ(static_cast<int>(walks.size()), shape.edge_count * (shape.dimension == 3 ? 2 : 1));
}

TEST_P(EveryElement, FacetsLookOutward) {
  for (int f = 0; f < shape.facet_count; ++f) {
    const auto& nodes = shape.facets[f].nodes;
    const Vec3d along = ideal[nodes[1]] - ideal[nodes[0]];
    const Vec3d normal =
        shape.dimension == 3 ? cross(along, ideal[nodes[2]] - ideal[nodes[0]]) : cross(along, up);

    EXPECT_GT(dot(normal, ideal[nodes[0]] - centre()), 0) << "facet " << f;
  }
}

TEST_P(EveryElement, EdgesOfTheIdealElementAreOfLengthOne) {
  for (const std::set<int>& edge : edges()) {
    EXPECT_NEAR(norm(ideal[*edge.rbegin()] - ideal[*edge.begin()]), 1, 1e-15);
  }
}

TEST_P(EveryElement, CornersRunAlongEdgesAndCoverEveryNode) {
  std::set<int> covered;
  for (int k = 0; k < shape.corner_count; ++k) {
    const CornerShape& corner = shape.corners[k];
    covered.insert(corner.node);
    std::set<int> neighbours;
    for (int n = 0; n < shape.dimension; ++n) {
      EXPECT_TRUE(edges().contains({corner.node, corner.neighbours[n]}));
      neighbours.insert(corner.neighbours[n]);
      covered.insert(corner.neighbours[n]);
    }
    EXPECT_EQ(static_cast<int>(neighbours.size()), shape.dimension);
  }
  EXPECT_EQ(static_cast<int>(covered.size()), shape.node_count);
}

TEST_P(EveryElement, EveryCornerOfTheIdealElementIsIdeal) {
  for (int k = 0; k < shape.corner_count; ++k) {
    const CornerGeometry corner = corner_geometry(shape, k, position, up);

    EXPECT_EQ(corner.sign, 1) << "corner " << k;
    EXPECT_NEAR(corner.determinant, shape.ideal.determinant, 1e-15);
    EXPECT_NEAR(corner.length_product, 1, 1e-15);
    EXPECT_NEAR(corner.shape_norm_squared, shape.dimension, 1e-14);
  }
}

TEST_P(EveryElement, CornersOfAMirroredElementAreNegative) {
  const auto mirrored = [&](int n) { return Vec3d{-ideal[n].x, ideal[n].y, ideal[n].z}; };

  for (int k = 0; k < shape.corner_count; ++k) {
    EXPECT_EQ(corner_geometry(shape, k, mirrored, up).sign, -1) << "corner " << k;
  }
}

TEST_P(EveryElement, IdealInverseIsTheInverseOfTheIdealEdges) {
  const CornerShape& corner = shape.corners[0];
  for (int row = 0; row < shape.dimension; ++row) {
    // The columns of T = A W^-1 are orthonormal when A is a rotated W.
    for (int other = 0; other <= row; ++other) {
      Vec3d a{0, 0, 0}, b{0, 0, 0};
      for (int n = 0; n < shape.dimension; ++n) {
        const Vec3d edge = ideal[corner.neighbours[n]] - ideal[corner.node];
        a += shape.ideal.inverse[n][row] * edge;
        b += shape.ideal.inverse[n][other] * edge;
      }
      EXPECT_NEAR(dot(a, b), row == other ? 1 : 0, 1e-15);
    }
  }
}

TEST_P(EveryElement, IdealElementHasItsKnownVolume) {
  const std::map<ElementType, double> volumes = {
      {ElementType::triangle, std::sqrt(3.0) / 4},     {ElementType::quad, 1},
      {ElementType::tetrahedron, 1 / std::sqrt(72.0)}, {ElementType::pyramid, std::sqrt(2.0) / 6},
      {ElementType::wedge, std::sqrt(3.0) / 4},        {ElementType::hexahedron, 1}};

  EXPECT_NEAR(element_volume(shape, position, up), volumes.at(GetParam()), 1e-15);
}

TEST(ElementTable, RowsStandAtTheirTypes) {
  for (const ElementType type : kLinearTypes) {
    EXPECT_EQ(&element_table()[static_cast<std::size_t>(type)], &element_shape(type));
  }
  EXPECT_EQ(element_name(ElementType::tetrahedron), "tetrahedron");
  EXPECT_EQ(element_name(ElementType::wedge), "wedge");
}

}  // namespace
}  // namespace meshsmooth
