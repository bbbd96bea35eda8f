// Meshes of second order: their corners move as those of the linear mesh, the other nodes follow.

#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <numbers>

#include "core/smoothing.hpp"
#include "mesh/curved_jacobian.hpp"
#include "meshsmooth/error.hpp"
#include "smooth/second_order/corner_mesh.hpp"
#include "support/mesh_size.hpp"
#include "support/second_order.hpp"

namespace meshsmooth {
namespace {

using test::points;
using testing::Contains;
using testing::HasSubstr;
using testing::Pair;

SmoothOptions by(const Method& method) {
  SmoothOptions options;
  options.method = method;
  options.max_iterations = 6;
  return options;
}

SmoothSummary smooth(Mesh& mesh, const SmoothOptions& options, const JobInput& input = {}) {
  return make_smoother("cpu", 2)->smooth(mesh, options, {}, input);
}

std::vector<std::pair<std::string, Mesh>> linear_meshes() {
  std::vector<std::pair<std::string, Mesh>> meshes;
  for (const ElementType type : kLinearTypes) {
    meshes.emplace_back(element_name(type), test::noisy(test::lattice(type, 6), 0.15, 3));
  }
  meshes.emplace_back("mixed", test::noisy(test::mixed_stack(4), 0.12, 12));
  return meshes;
}

/// Visits each node in the middle of others of a mesh, with the mean of its corners.
template <class Visit>
void for_each_mid(const Mesh& mesh, const Visit& visit) {
  for (const ElementBlock& block : mesh.blocks) {
    const std::size_t width = element_width(block.type);
    const auto mids = mid_nodes(block.type);
    for (std::size_t at = 0; at < block.nodes.size(); at += width) {
      for (std::size_t m = 0; m < mids.size(); ++m) {
        std::vector<NodeId> corners;
        for (int c = 0; c < mids[m].corner_count; ++c) {
          corners.push_back(block.nodes[at + static_cast<std::size_t>(
                                                 mids[m].corners[static_cast<std::size_t>(c)])]);
        }
        visit(block.nodes[at + width - mids.size() + m], corners);
      }
    }
  }
}

Vec3d mean(const Mesh& mesh, const std::vector<NodeId>& nodes) {
  Vec3d sum{0, 0, 0};
  for (const NodeId node : nodes) sum += points(mesh)[static_cast<std::size_t>(node)];
  return (1.0 / static_cast<double>(nodes.size())) * sum;
}

std::int64_t invalid_count(const Mesh& mesh) {
  const QualityStats quality = measure_quality(mesh);
  return quality.inverted_count + quality.degenerate_count;
}

// --- straight elements ------------------------------------------------------------

TEST(SecondOrder, MovesTheCornersAsTheLinearMeshDoes) {
  for (const auto& [name, linear] : linear_meshes()) {
    for (const Method& method :
         {Method(Optimize{}), Method(Laplacian{}), Method(SmartLaplacian{}), Method(Taubin{})}) {
      for (const bool full : {false, true}) {
        Mesh corners = linear;
        Mesh mesh = test::second_order(linear, full);
        const SmoothSummary expected = smooth(corners, by(method));

        const SmoothSummary summary = smooth(mesh, by(method));

        for (std::size_t n = 0; n < corners.node_count(); ++n) {
          ASSERT_EQ(points(mesh)[n], points(corners)[n]) << name << ", " << method_name(method);
        }
        for_each_mid(mesh, [&](NodeId node, const std::vector<NodeId>& of) {
          if (of.size() == 2) {
            ASSERT_EQ(points(mesh)[static_cast<std::size_t>(node)], mean(mesh, of)) << name;
          } else {
            ASSERT_LT(norm(points(mesh)[static_cast<std::size_t>(node)] - mean(mesh, of)), 1e-14);
          }
        });
        EXPECT_EQ(summary.convergence.iteration_count, expected.convergence.iteration_count);
        EXPECT_EQ(summary.quality_after.worst.front().mean_ratio,
                  expected.quality_after.worst.front().mean_ratio);
        EXPECT_TRUE(is_second_order(summary.quality_after.worst.front().type));
        EXPECT_EQ(summary.nodes.total, static_cast<std::int64_t>(mesh.node_count()));
        EXPECT_EQ(summary.nodes.isolated, 0);
        EXPECT_GE(summary.nodes.moved, expected.nodes.moved);
      }
    }
  }
}

TEST(SecondOrder, RoundsAMiddleOnceInFloat32) {
  Mesh mesh = test::as_float32(
      test::second_order(test::noisy(test::lattice(ElementType::tetrahedron, 6), 0.15, 3)));
  const auto& all = std::get<std::vector<Vec3f>>(mesh.positions);

  const SmoothSummary summary = smooth(mesh, by(Optimize{}));

  EXPECT_GT(summary.nodes.moved, 125);
  for_each_mid(test::second_order(test::lattice(ElementType::tetrahedron, 6)),
               [&](NodeId node, const std::vector<NodeId>& of) {
                 const Vec3f a = all[static_cast<std::size_t>(of[0])];
                 const Vec3f b = all[static_cast<std::size_t>(of[1])];
                 const Vec3f away = all[static_cast<std::size_t>(node)] - 0.5F * (a + b);
                 EXPECT_LT(norm(away), 1e-6F);
               });
}

TEST(SecondOrder, PreparesATopologyOnce) {
  const Mesh start = test::second_order(test::noisy(test::mixed_stack(4), 0.12, 12), true);
  const MeshTopology topology(start);
  const auto smoother = make_smoother("cpu", 2);
  const auto prepared = smoother->prepare(topology.view());
  Mesh first = start, second = start;

  const SmoothSummary summary =
      smoother->smooth(*prepared, first.positions_span(), by(Optimize{}), {});
  smoother->smooth(*prepared, second.positions_span(), by(Optimize{}), {});

  EXPECT_EQ(points(first), points(second));
  EXPECT_GT(summary.nodes.moved, 0);
  EXPECT_GT(prepared->bytes().host_bytes, 0);
  EXPECT_LE(prepared->bytes().host_bytes,
            smoother->estimate_prepared(test::size_of(start)).host_bytes);
  for_each_mid(first, [&](NodeId node, const std::vector<NodeId>& of) {
    EXPECT_LT(norm(points(first)[static_cast<std::size_t>(node)] - mean(first, of)), 1e-14);
  });
}

TEST(SecondOrder, BoundsTheMemoryOfTheCornersOfSmallMeshesToo) {
  for (const ElementType type : kLinearTypes) {
    for (const int side : {1, 3, 8}) {
      for (const bool full : {false, true}) {
        const Mesh mesh = test::second_order(test::lattice(type, side), full);
        const detail::CornerMesh corners(MeshTopology(mesh).view());
        EXPECT_LE(corners.bytes(), detail::CornerMesh::estimate_bytes(test::size_of(mesh)))
            << element_name(type) << ", " << side << (full ? ", full" : "");
        EXPECT_LE(
            corners.view().node_count,
            static_cast<std::size_t>(detail::CornerMesh::size_of(test::size_of(mesh)).node_count));
      }
    }
  }
}

// --- curved elements --------------------------------------------------------------

/// A box curved around an axis, its nodes in the middle of edges too.
Mesh curved_box(ElementType type, int n, bool full = false) {
  const Mesh linear = test::noisy(test::lattice(type, n), 0.08, 5);
  return test::mapped(test::second_order(linear, full), [&](Vec3d p) {
    const double angle = p.x / n * std::numbers::pi / 2, radius = n * (1.0 + p.y / n);
    return Vec3d{radius * std::sin(angle), radius * std::cos(angle), p.z};
  });
}

TEST(SecondOrder, KeepsCurvedElementsValidAndTheirBoundaryInPlace) {
  for (const ElementType type : kLinearTypes) {
    for (const bool full : {false, true}) {
      const Mesh start = curved_box(type, 5, full);
      ASSERT_EQ(invalid_count(start), 0) << element_name(type);
      for (const Method& method : {Method(Optimize{}), Method(Laplacian{}), Method(Taubin{})}) {
        Mesh mesh = start;

        SmoothOptions options = by(method);
        options.never_worse = false;

        const SmoothSummary summary = smooth(mesh, options);

        EXPECT_EQ(invalid_count(mesh), 0) << element_name(type) << ", " << method_name(method);
        EXPECT_EQ(summary.quality_after.inverted_count, 0);
        EXPECT_GT(summary.nodes.moved, 0) << element_name(type);
        const std::vector<NodeId> boundary = find_boundary_nodes(MeshTopology(mesh).view());
        for (const NodeId node : boundary) {
          ASSERT_EQ(points(mesh)[static_cast<std::size_t>(node)],
                    points(start)[static_cast<std::size_t>(node)]);
        }
      }
    }
  }
}

TEST(SecondOrder, PutsCornersBackThatWouldSpoilACurvedElement) {
  std::int64_t held = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    const Mesh linear = test::noisy(test::lattice(ElementType::tetrahedron, 4), 0.2, seed);
    Mesh mesh = test::second_order(linear);
    // Nodes in the middle lie up to a third of an edge away from there, as far as that is valid.
    const Mesh noise = test::noisy(mesh, 0.3, seed + 100);
    const auto corner_count = linear.node_count();
    for (std::size_t n = corner_count; n < mesh.node_count(); n += 3) {
      const Vec3d straight = points(mesh)[n];
      points(mesh)[n] = points(noise)[n];
      if (invalid_count(mesh) > 0) points(mesh)[n] = straight;
    }
    ASSERT_EQ(invalid_count(mesh), 0);

    const SmoothSummary summary = smooth(mesh, by(Optimize{}));

    EXPECT_EQ(invalid_count(mesh), 0) << seed;
    EXPECT_EQ(summary.quality_after.inverted_count + summary.quality_after.degenerate_count, 0);
    held += summary.convergence.held_node_count;
  }
  EXPECT_GT(held, 0);  // it was needed
}

TEST(SecondOrder, CuresElementsThatAreCurvedTooMuch) {
  for (const ElementType type : kLinearTypes) {
    const Mesh linear = test::noisy(test::lattice(type, 4), 0.1, 3);
    const Mesh straight = test::second_order(linear);
    const std::vector<NodeId> boundary = find_boundary_nodes(MeshTopology(straight).view());
    Mesh mesh = test::noisy(straight, 0.35, 9);
    for (std::size_t n = 0; n < linear.node_count(); ++n) points(mesh)[n] = points(straight)[n];
    for (const NodeId node : boundary) {
      points(mesh)[static_cast<std::size_t>(node)] =
          points(straight)[static_cast<std::size_t>(node)];
    }
    ASSERT_GT(invalid_count(mesh), 0) << element_name(type);

    const SmoothSummary summary = smooth(mesh, by(Optimize{}));

    EXPECT_EQ(invalid_count(mesh), 0) << element_name(type);
    EXPECT_EQ(summary.quality_after.inverted_count, 0);
    EXPECT_GT(summary.quality_before.inverted_count, 0);
    for (const NodeId node : boundary) {
      ASSERT_EQ(points(mesh)[static_cast<std::size_t>(node)],
                points(straight)[static_cast<std::size_t>(node)]);
    }
  }
}

/// Straight tetrahedra but for the nodes in the middle of inner edges, which are anywhere.
Mesh tangled_edges() {
  const Mesh linear = test::noisy(test::lattice(ElementType::tetrahedron, 4), 0.1, 3);
  const Mesh straight = test::second_order(linear);
  Mesh mesh = test::noisy(straight, 0.35, 9);
  for (std::size_t n = 0; n < linear.node_count(); ++n) points(mesh)[n] = points(straight)[n];
  for (const NodeId node : find_boundary_nodes(MeshTopology(straight).view())) {
    points(mesh)[static_cast<std::size_t>(node)] = points(straight)[static_cast<std::size_t>(node)];
  }
  return mesh;
}

TEST(SecondOrder, ACureKeepsTheLimitOfMovesAndCanBeCancelled) {
  const Mesh start = tangled_edges();
  Mesh mesh = start;
  SmoothOptions options = by(Optimize{});

  for (const double limit : {0.01, 0.08, 1.0}) {
    mesh = start;
    options.movement_limit = MovementLimit{.value = limit};

    smooth(mesh, options);

    double furthest = 0;
    for (std::size_t n = 0; n < mesh.node_count(); ++n) {
      furthest = std::max(furthest, norm(points(mesh)[n] - points(start)[n]));
    }
    EXPECT_LE(furthest, limit * (1 + 1e-9));
    EXPECT_LT(invalid_count(mesh), invalid_count(start)) << limit;
  }
  EXPECT_EQ(invalid_count(mesh), 0);  // the last limit is none
  const std::atomic<bool> finish_early = true;
  mesh = start;
  JobControl control;
  control.finish_early = &finish_early;
  const SmoothSummary summary = make_smoother("cpu", 2)->smooth(mesh, by(Optimize{}), control);
  EXPECT_EQ(summary.stop_reason, StopReason::cancelled_with_result);
}

TEST(SecondOrder, ACureOfBadElementsOnlyLeavesTheOthers) {
  const Mesh start = tangled_edges();
  Mesh mesh = start;
  SmoothOptions options = by(Optimize{});
  options.only_below = OnlyBelow{.quality = 1e-6, .rings = 0};

  smooth(mesh, options);

  EXPECT_LT(invalid_count(mesh), invalid_count(start));
  std::vector<std::uint8_t> bad(start.node_count());
  for (const ElementBlock& block : start.blocks) {
    const std::size_t width = element_width(block.type);
    for (std::size_t at = 0; at < block.nodes.size(); at += width) {
      const auto nodes = std::span(block.nodes).subspan(at, width);
      const auto own = detail::positions_of(nodes, std::span<const Vec3d>(points(start)));
      if (detail::is_valid(block.type, own.data(), {0, 0, 0})) continue;
      for (const NodeId node : nodes) bad[static_cast<std::size_t>(node)] = 1;
    }
  }
  for (std::size_t n = 0; n < start.node_count(); ++n) {
    ASSERT_TRUE(bad[n] != 0 || points(mesh)[n] == points(start)[n]) << n;
  }
}

/// The worst share of an element's mean that a Bézier coefficient of its Jacobian has.
double worst_share(const Mesh& mesh) {
  double worst = 1;
  std::array<double, detail::kMostJacobianCoefficients> found{};
  for (const ElementBlock& block : mesh.blocks) {
    const std::size_t width = element_width(block.type);
    for (std::size_t at = 0; at < block.nodes.size(); at += width) {
      const auto nodes = detail::positions_of(std::span(block.nodes).subspan(at, width),
                                              std::span<const Vec3d>(points(mesh)));
      const std::size_t count =
          detail::jacobian_coefficients(block.type, nodes.data(), {0, 0, 1}, found.data());
      double sum = 0;
      for (std::size_t k = 0; k < count; ++k) sum += found[k];
      const double mean = sum / static_cast<double>(count);
      for (std::size_t k = 0; k < count; ++k) {
        worst = std::min({worst, found[k] / mean, mean / found[k]});
      }
    }
  }
  return worst;
}

/// Valid elements whose inner nodes, but for the corners, lie beside the middle.
Mesh distorted(ElementType type, double by) {
  const Mesh linear = test::lattice(type, 5);
  Mesh mesh = test::second_order(linear);
  const Mesh noise = test::noisy(mesh, by, 4);
  const std::vector<NodeId> boundary = find_boundary_nodes(MeshTopology(mesh).view());
  for (std::size_t n = linear.node_count(); n < mesh.node_count(); ++n) {
    const bool inner = !std::ranges::binary_search(boundary, static_cast<NodeId>(n));
    if (inner) points(mesh)[n] = points(noise)[n];
  }
  return mesh;
}

TEST(SecondOrder, StraightensDistortedElements) {
  for (const auto& [type, by_length] :
       {std::pair(ElementType::triangle, 0.1), std::pair(ElementType::tetrahedron, 0.06)}) {
    const Mesh start = distorted(type, by_length);
    ASSERT_EQ(invalid_count(start), 0) << element_name(type);
    ASSERT_LT(worst_share(start), 0.45) << element_name(type);
    Mesh mesh = start;

    smooth(mesh, by(Optimize{}));

    EXPECT_GT(worst_share(mesh), 0.6) << element_name(type);
    for (const NodeId node : find_boundary_nodes(MeshTopology(mesh).view())) {
      ASSERT_EQ(points(mesh)[static_cast<std::size_t>(node)],
                points(start)[static_cast<std::size_t>(node)]);
    }
    for (const int threads : {1, 3}) {
      Mesh again = start;
      make_smoother("cpu", threads)->smooth(again, by(Optimize{}));
      EXPECT_EQ(points(again), points(mesh)) << threads;
    }
  }
}

TEST(SecondOrder, CuresNothingAcrossRegions) {
  Mesh mesh = test::second_order(test::noisy(test::lattice(ElementType::tetrahedron, 4), 0.1, 3));
  for (std::size_t e = 0; e < mesh.element_count(); ++e) {
    mesh.regions.push_back(e < mesh.element_count() / 2 ? 1 : 2);
  }
  const std::vector<NodeId> held = find_boundary_nodes(MeshTopology(mesh).view(), true);
  const std::vector<NodeId> boundary = find_boundary_nodes(MeshTopology(mesh).view());
  ASSERT_GT(held.size(), boundary.size());
  const Mesh noise = test::noisy(mesh, 0.35, 9);
  for (std::size_t n = 125; n < mesh.node_count(); ++n) {
    if (!std::ranges::binary_search(held, static_cast<NodeId>(n)))
      points(mesh)[n] = points(noise)[n];
  }
  const Mesh start = mesh;
  ASSERT_GT(invalid_count(start), 0);

  smooth(mesh, by(Optimize{}));

  EXPECT_EQ(invalid_count(mesh), 0);
  for (const NodeId node : held) {
    ASSERT_EQ(points(mesh)[static_cast<std::size_t>(node)],
              points(start)[static_cast<std::size_t>(node)]);
  }
}

TEST(SecondOrder, CountsWhatIsInvalidBetweenValidCorners) {
  Mesh mesh = test::second_order(test::single(ElementType::tetrahedron));
  EXPECT_EQ(invalid_count(mesh), 0);

  points(mesh)[4] += Vec3d{0, 0.9, 0.6};

  EXPECT_EQ(measure_quality(mesh).inverted_count, 1);
  SmoothOptions refusing = by(Optimize{});
  refusing.tangled = TangledPolicy::refuse;
  try {
    smooth(mesh, refusing);
    ADD_FAILURE() << "nothing thrown";
  } catch (const InvalidMesh& error) {
    EXPECT_EQ(error.reason(), "MESH_TANGLED");
  }
}

TEST(SecondOrder, FixedNodesKeepTheirBits) {
  Mesh mesh = curved_box(ElementType::tetrahedron, 5);
  mesh.fixed.assign(mesh.node_count(), 0);
  for (std::size_t n = 0; n < mesh.node_count(); n += 7) mesh.fixed[n] = 1;
  const Mesh start = mesh;

  smooth(mesh, by(Optimize{}));

  for (std::size_t n = 0; n < mesh.node_count(); n += 7) {
    ASSERT_EQ(points(mesh)[n], points(start)[n]) << n;
  }
  EXPECT_EQ(invalid_count(mesh), 0);
}

TEST(SecondOrder, HoldsTheCornersOfCurvedEdgesThatWouldSlide) {
  Mesh mesh = curved_box(ElementType::hexahedron, 5);
  const Mesh start = mesh;
  SmoothOptions options = by(Optimize{});
  options.boundary = BoundaryPolicy::slide;

  const SmoothSummary summary = smooth(mesh, options);

  EXPECT_GT(summary.nodes.curved, 0);
  const double inner = 5, outer = 10;  // the cylinders that bound it
  for (const NodeId node : find_boundary_nodes(MeshTopology(mesh).view())) {
    const Vec3d from = points(start)[static_cast<std::size_t>(node)];
    const Vec3d to = points(mesh)[static_cast<std::size_t>(node)];
    for (const double radius : {inner, outer}) {
      if (std::abs(std::hypot(from.x, from.y) - radius) > 1e-9) continue;
      EXPECT_EQ(to, from);
    }
  }
}

/// A mesh of second order, its boundary nodes and where a wave puts them.
struct Wave {
  Mesh start = test::second_order(test::noisy(test::lattice(ElementType::tetrahedron, 5), 0.1, 2));
  std::vector<NodeId> nodes = find_boundary_nodes(MeshTopology(start).view());
  std::vector<Vec3d> to;
  SmoothOptions options{.method = Move{}};

  [[nodiscard]] JobInput input() const {
    return {.prescribed = {nodes, std::span<const Vec3d>(to)}};
  }

  explicit Wave(double height) {
    for (const NodeId node : nodes) {
      Vec3d p = points(start)[static_cast<std::size_t>(node)];
      p.z += height * std::sin(p.x) * p.z;
      to.push_back(p);
    }
  }
};

TEST(SecondOrder, MovesToGivenPositions) {
  const Wave wave(0.08);
  Mesh mesh = wave.start;

  const SmoothSummary summary = smooth(mesh, wave.options, wave.input());

  EXPECT_EQ(summary.motion->reached, 1);
  EXPECT_EQ(invalid_count(mesh), 0);
  for (std::size_t n = 0; n < wave.nodes.size(); ++n) {
    ASSERT_EQ(points(mesh)[static_cast<std::size_t>(wave.nodes[n])], wave.to[n]);
  }
}

TEST(SecondOrder, MovesFromWhatIsGivenWhateverTheResultIs) {
  for (const double height : {0.08, 3.0}) {  // the second is not reached
    const Wave wave(height);
    Mesh expected = wave.start;
    const SmoothSummary by_positions = smooth(expected, wave.options, wave.input());
    const MeshTopology topology(wave.start);
    const auto smoother = make_smoother("cpu", 2);
    const auto prepared = smoother->prepare(topology.view());
    for (const bool is_prepared : {false, true}) {
      std::vector<Vec3d> result(wave.start.node_count(), Vec3d{std::nan(""), 0, 0});

      JobPositions arrays(std::span<const Vec3d>(points(wave.start)), std::span(result));
      arrays.input = wave.input();

      const SmoothSummary summary =
          is_prepared ? smoother->smooth(*prepared, arrays, wave.options, {})
                      : smoother->smooth(topology.view(), arrays, wave.options, {});

      EXPECT_EQ(summary.motion->reached, by_positions.motion->reached);
      EXPECT_EQ(summary.nodes.moved, by_positions.nodes.moved);
      EXPECT_EQ(result, points(expected));
    }
  }
}

// --- what is refused --------------------------------------------------------------

std::pair<std::string, std::string> refusal(Mesh mesh) {
  try {
    smooth(mesh, by(Optimize{}));
  } catch (const InvalidMesh& error) {
    return {std::string(error.reason()), error.what()};
  }
  return {};
}

TEST(SecondOrder, RefusesNodesInTheOrderOfAnotherProgram) {
  Mesh mesh = test::second_order(test::lattice(ElementType::tetrahedron, 2));
  auto& nodes = mesh.blocks[0].nodes;
  for (std::size_t at = 0; at < nodes.size(); at += 10) std::swap(nodes[at + 8], nodes[at + 9]);

  const auto [reason, message] = refusal(mesh);

  EXPECT_EQ(reason, "MID_NODE_MISPLACED");
  EXPECT_THAT(message, HasSubstr("in the middle of the nodes"));

  Mesh corner = test::second_order(test::lattice(ElementType::tetrahedron, 2));
  corner.blocks[0].nodes[14] = 26;  // a corner of the box, far from the second element
  EXPECT_EQ(refusal(corner).first, "MID_NODE_MISPLACED");
}

TEST(SecondOrder, RefusesTwoOrdersInOneMesh) {
  Mesh mesh = test::second_order(test::lattice(ElementType::tetrahedron, 2));
  mesh.blocks.push_back({ElementType::tetrahedron, {0, 1, 2, 3}});

  const auto [reason, message] = refusal(mesh);

  EXPECT_EQ(reason, "MIXED_ORDERS");
  EXPECT_THAT(message, HasSubstr("tetrahedron10"));
}

TEST(SecondOrder, NamesTheNodesOfAFacetThatThreeElementsUse) {
  Mesh linear = test::overused_facet();
  Mesh mesh = test::second_order(linear);
  // The corners get other numbers in the linear mesh than here.
  std::rotate(points(mesh).begin(), points(mesh).begin() + 6, points(mesh).end());
  for (NodeId& node : mesh.blocks[0].nodes) {
    node = (node + static_cast<NodeId>(mesh.node_count()) - 6) %
           static_cast<NodeId>(mesh.node_count());
  }
  try {
    smooth(mesh, by(Optimize{}));
    ADD_FAILURE() << "nothing thrown";
  } catch (const InvalidMesh& error) {
    EXPECT_EQ(error.reason(), "FACET_OVERUSED");
    const auto& first = mesh.blocks[0].nodes;
    std::vector<NodeId> facet = {first[0], first[1], first[2]};
    std::ranges::sort(facet);
    EXPECT_THAT(error.details(), Contains(Pair("facet_nodes", std::to_string(facet[0]) + ", " +
                                                                  std::to_string(facet[1]) + ", " +
                                                                  std::to_string(facet[2]))));
  }
}

}  // namespace
}  // namespace meshsmooth
