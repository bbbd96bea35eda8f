#pragma once

#include <cstddef>
#include <cstdint>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::formats {

/// Test meshes, the same on any machine for the same arguments. Positions are
/// float64. `tangle` in [0, 0.45] throws interior nodes about until about that
/// share of the elements is inverted. All throw `InvalidOption`
/// (OPTION_OUT_OF_RANGE) for counts that make no mesh, and the TetGen ones
/// `NotSupported` (OPTION_NOT_SUPPORTED) in a build without TetGen.

/// The unit cube of Xiao et al. 2019: nodes of a regular grid on the surface,
/// uniformly random nodes inside, Delaunay tetrahedra (TetGen). Exactly
/// `node_count` nodes, at least 27. O(n log n).
[[nodiscard]] Mesh generate_cube(std::size_t node_count, std::uint64_t seed, double tangle = 0);

/// A bank of earth: base, inclined face, upper bench; made like the cube.
/// Exactly `node_count` nodes, at least 100.
[[nodiscard]] Mesh generate_slope(std::size_t node_count, std::uint64_t seed, double tangle = 0);

/// Hexahedra, pyramids, tetrahedra and wedges in one conforming mesh, interior
/// nodes jittered; about `node_count` nodes, at least 30.
[[nodiscard]] Mesh generate_mixed(std::size_t node_count, std::uint64_t seed, double tangle = 0);

/// Plane triangles on the unit square, interior nodes jittered; about
/// `node_count` nodes, at least 9.
[[nodiscard]] Mesh generate_square(std::size_t node_count, std::uint64_t seed, double tangle = 0);

/// A closed triangle surface: the unit sphere with radial noise of relative
/// size `noise`; about `node_count` nodes, at least 6.
[[nodiscard]] Mesh generate_sphere(std::size_t node_count, std::uint64_t seed, double noise = 0.02);

/// The unit ball: nodes about evenly on the sphere, uniformly random ones inside, Delaunay
/// tetrahedra (TetGen). Exactly `node_count` nodes, at least 100. O(n log n).
[[nodiscard]] Mesh generate_ball(std::size_t node_count, std::uint64_t seed, double tangle = 0);

/// A pipe of the radii 1/2 and 1 and the length 1: tetrahedra of a regular grid, nodes
/// jittered along the surfaces that they are on; `node_count`, at least 216, or up to a quarter
/// more.
[[nodiscard]] Mesh generate_pipe(std::size_t node_count, std::uint64_t seed, double tangle = 0);

}  // namespace meshsmooth::formats
