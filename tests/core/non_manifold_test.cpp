// Surface meshes in which three and more elements share an edge: stiffeners, T-junctions.

#include <gmock/gmock.h>

#include <random>
#include <set>

#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/numbering.hpp"
#include "support/second_order.hpp"

namespace meshsmooth {
namespace {

using test::Job;
using test::points;
using testing::AllOf;
using testing::HasSubstr;

constexpr int kCells = 6, kRows = 3;  // of the plate a side; of the web

/// A plate and a web on its middle row, which stands on it or, folded down, lies in its plane.
struct Stiffened {
  Mesh mesh;
  std::vector<NodeId> junction;

  Stiffened(ElementType type, bool folded, double jitter = 0.3) {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> off(-jitter, jitter);
    std::vector<Vec3d> at;
    const auto inside = [](int i, int last) { return i > 0 && i < last; };
    for (int j = 0; j <= kCells; ++j) {
      for (int i = 0; i <= kCells; ++i) {
        const double u = off(random), v = off(random);
        const bool middle = j == kCells / 2;
        const bool free = inside(i, kCells) && inside(j, kCells) && !middle;
        // The junction is graded, so that sliding along it pays.
        const double x = middle && inside(i, kCells) ? i + 0.3 * std::sin(1.7 * i) : i;
        at.push_back({x + (free ? u : 0), j + (free ? v : 0), 0});
        if (middle) junction.push_back(static_cast<NodeId>(at.size() - 1));
      }
    }
    const std::size_t plate = at.size();
    for (int k = 1; k <= kRows; ++k) {
      for (int i = 0; i <= kCells; ++i) {
        const double u = off(random), v = off(random);
        const bool free = inside(i, kCells) && k < kRows;
        const double x = i + (free ? u : 0), up = k + (free ? v : 0), foot = kCells / 2;
        at.push_back(folded ? Vec3d{x, foot + 0.8 * up, 0} : Vec3d{x, foot, up});
      }
    }
    const auto web = [&](int i, int k) {
      return k == 0 ? junction[static_cast<std::size_t>(i)]
                    : static_cast<NodeId>(plate) + (k - 1) * (kCells + 1) + i;
    };
    std::vector<NodeId> nodes;
    const auto add = [&](NodeId a, NodeId b, NodeId c, NodeId d) {
      if (linear_type(type) == ElementType::quad) {
        nodes.insert(nodes.end(), {a, b, c, d});
      } else {
        nodes.insert(nodes.end(), {a, b, c, a, c, d});
      }
    };
    for (int j = 0; j < kCells; ++j) {
      for (int i = 0; i < kCells; ++i) {
        const NodeId a = j * (kCells + 1) + i;
        add(a, a + 1, a + kCells + 2, a + kCells + 1);
      }
    }
    for (int k = 0; k < kRows; ++k) {
      for (int i = 0; i < kCells; ++i) {
        add(web(i, k), web(i + 1, k), web(i + 1, k + 1), web(i, k + 1));
      }
    }
    mesh = test::make_mesh(std::move(at), {{linear_type(type), std::move(nodes)}});
    if (is_second_order(type)) mesh = test::second_order(mesh, type == ElementType::quad9);
  }
};

constexpr ElementType kSurfaceTypes[] = {ElementType::triangle, ElementType::quad,
                                         ElementType::triangle6, ElementType::quad8,
                                         ElementType::quad9};

bool stays(const Mesh& before, const Mesh& after, NodeId node) {
  return points(before)[node] == points(after)[node];
}

double area(const Mesh& mesh) { return measure_quality(mesh).sum_absolute_volume; }

class NonManifoldWay : public testing::TestWithParam<test::Way> {};
INSTANTIATE_TEST_SUITE_P(Shells, NonManifoldWay, testing::ValuesIn(test::ways(true)),
                         test::way_name);

TEST_P(NonManifoldWay, HoldsTheJunctionAndImprovesTheRest) {
  for (const ElementType type : kSurfaceTypes) {
    for (const bool folded : {false, true}) {
      SCOPED_TRACE(std::string(element_name(type)) + (folded ? " folded" : ""));
      const Stiffened shell(type, folded);
      for (const BoundaryPolicy boundary : {BoundaryPolicy::fixed, BoundaryPolicy::slide}) {
        const bool slides = boundary == BoundaryPolicy::slide && !folded &&
                            std::holds_alternative<Optimize>(GetParam().method);
        const Job job = test::smooth(shell.mesh, {.method = GetParam().method,
                                                  .form = GetParam().form,
                                                  .max_iterations = 20,
                                                  .boundary = boundary});

        EXPECT_EQ(job.summary.nodes.on_non_manifold_edges, kCells + 1);
        for (const NodeId node : shell.junction) {
          EXPECT_TRUE(slides || stays(shell.mesh, job.mesh, node)) << node;
          EXPECT_EQ(points(job.mesh)[node].y, kCells / 2);
          EXPECT_EQ(points(job.mesh)[node].z, 0);
        }
        EXPECT_GT(job.summary.nodes.moved, 10);
        EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
        EXPECT_NEAR(area(job.mesh), area(shell.mesh), 1e-9);
      }
    }
  }
}

TEST(NonManifold, TheBoundaryDoesNotFreeTheJunction) {
  for (const ElementType type : kSurfaceTypes) {
    for (const bool folded : {false, true}) {
      for (const Method& method :
           {Method{SmartLaplacian{}}, Method{Taubin{}}, Method{Optimize{}}}) {
        const Stiffened shell(type, folded);
        const Job job = test::smooth(
            shell.mesh, {.method = method, .max_iterations = 5, .boundary = BoundaryPolicy::free});
        for (const NodeId node : shell.junction) {
          EXPECT_EQ(points(job.mesh)[node].y, kCells / 2);
          EXPECT_EQ(points(job.mesh)[node].z, 0);
        }
      }
    }
  }
}

TEST(NonManifold, OptimizeSlidesAlongTheJunctionOfCurvedSurfaces) {
  for (const ElementType type : {ElementType::triangle, ElementType::quad}) {
    const Stiffened shell(type, false);
    const Job fixed = test::smooth(shell.mesh, {});
    const Job slid = test::smooth(shell.mesh, {.boundary = BoundaryPolicy::slide});

    int moved = 0;
    for (const NodeId node : shell.junction) moved += stays(shell.mesh, slid.mesh, node) ? 0 : 1;
    EXPECT_EQ(moved, kCells - 1);
    for (const NodeId end : {shell.junction.front(), shell.junction.back()}) {
      EXPECT_TRUE(stays(shell.mesh, slid.mesh, end));
    }
    EXPECT_GT(test::mean_ratio(slid.summary.quality_after).mean,
              test::mean_ratio(fixed.summary.quality_after).mean);
    EXPECT_LE(slid.summary.deviation.result_to_input, slid.summary.deviation.tolerance);
  }
}

TEST(NonManifold, AreCountedApartFromTheBoundary) {
  const Stiffened shell(ElementType::triangle, false);
  const Job job = test::smooth(shell.mesh, {});
  const int plate = 4 * kCells - 2, web = 2 * (kRows - 1) + kCells + 1;

  EXPECT_EQ(job.summary.nodes.boundary, plate + web);
  EXPECT_EQ(job.summary.nodes.fixed, plate + web + kCells + 1);
}

TEST(NonManifold, RegionsAndCallersNodesStayWithThem) {
  Stiffened shell(ElementType::quad, true);
  shell.mesh.regions.assign(shell.mesh.element_count(), 0);
  for (std::size_t e = kCells * kCells; e < shell.mesh.element_count(); ++e) {
    shell.mesh.regions[e] = 1;
  }
  shell.mesh.fixed.assign(shell.mesh.node_count(), 0);
  shell.mesh.fixed[kCells + 2] = 1;
  for (const BoundaryPolicy boundary :
       {BoundaryPolicy::fixed, BoundaryPolicy::slide, BoundaryPolicy::free}) {
    const Job job = test::smooth(shell.mesh, {.boundary = boundary});
    for (const NodeId node : shell.junction) EXPECT_TRUE(stays(shell.mesh, job.mesh, node));
    EXPECT_TRUE(stays(shell.mesh, job.mesh, kCells + 2));
  }
}

TEST(NonManifold, PreparedTopologiesGiveTheSame) {
  for (const ElementType type : kSurfaceTypes) {
    const Stiffened shell(type, false);
    const auto smoother = make_smoother("cpu", 2);
    const MeshTopology topology(shell.mesh);
    const auto prepared = smoother->prepare(topology.view());
    std::vector<Vec3d> positions = points(shell.mesh);
    const SmoothSummary summary =
        smoother->smooth(*prepared, std::span<Vec3d>(positions), SmoothOptions{}, {});

    EXPECT_EQ(summary.nodes.on_non_manifold_edges, kCells + 1);
    EXPECT_EQ(prepared->boundary_node_count(), summary.nodes.boundary);
    for (const NodeId node : shell.junction) EXPECT_EQ(positions[node], points(shell.mesh)[node]);
  }
}

TEST(NonManifold, GiveTheSameBitsOnAnyNumberOfThreads) {
  const Stiffened shell(ElementType::triangle, false);
  const Mesh one = test::smooth(shell.mesh, {}, 1).mesh;
  EXPECT_TRUE(test::same_bits(one, test::smooth(shell.mesh, {}, 3).mesh));
}

TEST(NonManifold, IsNoReasonToStartAnew) {
  for (const ElementType type : {ElementType::triangle, ElementType::quad}) {
    Mesh mesh = Stiffened(type, false).mesh;
    EXPECT_EQ(test::count_starts(mesh), 1) << element_name(type);
    std::vector<std::uint8_t> mirrored(mesh.element_count());
    mirrored[0] = 1;
    mirror_elements(mesh.blocks, mirrored);
    EXPECT_EQ(test::count_starts(mesh), 2) << element_name(type);
  }
}

TEST(NonManifold, TheirNodesAreAmongThoseOfTheBoundary) {
  const Stiffened shell(ElementType::quad8, true);
  const std::vector<NodeId> boundary = find_boundary_nodes(MeshTopology(shell.mesh).view());
  const std::set<NodeId> found(boundary.begin(), boundary.end());
  for (const NodeId node : shell.junction) EXPECT_TRUE(found.contains(node));
  // A node in the middle of each edge: of the plate's outline, the junction, the web's outline.
  const auto mids = 4 * kCells + kCells + kCells + 2 * kRows;
  EXPECT_EQ(found.size(), 4 * kCells + (kCells - 1) + (kCells + 1) + 2 * (kRows - 1) + mids);
}

std::string refusal(const Mesh& mesh) {
  try {
    test::smooth(mesh, {});
  } catch (const InvalidMesh& error) {
    EXPECT_EQ(error.reason(), "FACET_OVERUSED");
    return error.what();
  }
  return "nothing thrown";
}

TEST(NonManifold, VolumeMeshesSayWhichElementIsThereTwice) {
  for (const ElementType type : kLinearTypes) {
    if (element_shape(type).dimension == 2) continue;
    SCOPED_TRACE(element_name(type));
    Mesh mesh = test::lattice(type, 3);
    // The first element once more.
    const std::string last = std::to_string(mesh.element_count());
    std::vector<NodeId> nodes = mesh.blocks[0].nodes;
    nodes.insert(nodes.end(), nodes.begin(),
                 nodes.begin() + static_cast<std::ptrdiff_t>(element_width(type)));
    mesh.blocks[0].nodes = nodes;
    const auto expected =
        AllOf(HasSubstr("element " + last + " is in the mesh twice, as element 0"),
              HasSubstr("belongs to one or two elements"));

    EXPECT_THAT(refusal(mesh), expected);
    EXPECT_THAT(refusal(test::second_order(mesh)), expected);
    EXPECT_THAT(refusal(test::second_order(mesh, true)), expected);
    // In another order of its nodes.
    std::rotate(nodes.end() - element_width(type), nodes.end() - 1, nodes.end());
    mesh.blocks[0].nodes = nodes;
    EXPECT_THAT(refusal(mesh), HasSubstr("twice, as element 0"));
  }
  EXPECT_THAT(refusal(test::overused_facet()),
              AllOf(HasSubstr("element 2: its facet"), HasSubstr("0, 1, 2")));
}

}  // namespace
}  // namespace meshsmooth
