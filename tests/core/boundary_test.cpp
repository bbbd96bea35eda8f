#include <gmock/gmock.h>

#include "core/steps.hpp"

namespace meshsmooth {
namespace {

using test::Steps;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::UnorderedElementsAre;

TEST(FindBoundary, MarksTheNodesOfFacetsUsedOnce) {
  for (const auto& [name, mesh] : test::step_meshes()) {
    EXPECT_EQ(Steps(mesh).boundary(), test::oracle::boundary_nodes(mesh)) << name;
  }
}

TEST(FindBoundary, BySortingMarksTheSame) {
  for (const auto& [name, mesh] : test::step_meshes()) {
    EXPECT_EQ(Steps(mesh).boundary_by_sorting(), test::oracle::boundary_nodes(mesh)) << name;
  }
}

TEST(FindBoundary, KnowsSmallMeshesByHand) {
  EXPECT_THAT(Steps(test::tet_ball()).boundary(), UnorderedElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(Steps(test::open_cone(4)).boundary(), UnorderedElementsAre(1, 2, 3, 4));
  EXPECT_THAT(Steps(test::sphere(2)).boundary(), IsEmpty());
}

TEST(FindBoundary, LeavesAnIsolatedNodeOut) {
  EXPECT_THAT(Steps(test::with_isolated_node(test::two_tets())).boundary(),
              UnorderedElementsAre(0, 1, 2, 3, 4));
}

TEST(FindBoundary, IsTheSameForEveryNumberOfThreads) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 17), 0.1, 2);
  const auto expected = Steps(mesh, 1).boundary();

  EXPECT_EQ(Steps(mesh, 2).boundary(), expected);
  EXPECT_EQ(Steps(mesh, 5).boundary(), expected);
}

TEST(FindBoundary, NamesTheFacetThatThreeElementsUse) {
  const Mesh mesh = test::overused_facet();
  for (const bool by_sorting : {false, true}) {
    Steps steps(mesh);
    try {
      static_cast<void>(by_sorting ? steps.boundary_by_sorting() : steps.boundary());
      FAIL() << "nothing thrown";
    } catch (const InvalidMesh& error) {
      EXPECT_EQ(error.reason(), "FACET_OVERUSED");
      EXPECT_THAT(error.what(), HasSubstr("element 2"));
      EXPECT_THAT(error.what(), HasSubstr("0, 1, 2"));
      EXPECT_THAT(error.details(), Contains(Pair("element", "2")));
      EXPECT_THAT(error.details(), Contains(Pair("facet_nodes", "0, 1, 2")));
    }
  }
}

TEST(FindBoundary, MarksTheEdgeThatThreeTrianglesUse) {
  const Mesh mesh = test::make_mesh({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}},
                                    {{ElementType::triangle, {0, 1, 2, 0, 1, 3, 0, 1, 4}}});
  EXPECT_THAT(Steps(mesh).boundary(), UnorderedElementsAre(2, 3, 4));
  EXPECT_THAT(Steps(mesh).non_manifold(), UnorderedElementsAre(0, 1));
}

}  // namespace
}  // namespace meshsmooth
