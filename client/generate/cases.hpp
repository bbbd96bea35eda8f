#pragma once

#include <array>
#include <cstdint>

#include "formats/mesh_file.hpp"

namespace meshsmooth::formats {

/// Meshes whose errors a smoother must repair: a boundary that moved while the interior stayed,
/// graded layers, local damage. The same on any machine for the same options. Node order and
/// elements do not depend on how far the boundary moves or the nodes are thrown, so the same
/// options without that give the reference. Positions are float64.
///
/// The point array "fixed" (`find_node_set`) is 1 at the nodes that stay even where the rest of
/// the boundary slides or is free. All throw `InvalidOption` (OPTION_OUT_OF_RANGE), which names
/// the option; those made by Gmsh throw `NotSupported` (OPTION_NOT_SUPPORTED) in a build without.
inline constexpr const char* kFixedArray = "fixed";
/// The cell array of `generate_layer`: 1 for elements on the wall, 2 above …, 0 in the core.
inline constexpr const char* kLayerArray = "layer";

/// An annulus of the radii 0.4 and 1 around the z axis: `rows` rows of 8 * rows triangles, every
/// second row of nodes shifted by half an edge, (rows + 1) * 4 * rows nodes. The nodes of the
/// inner circle are rotated by `degrees`. With `layers` it is extruded to that many layers of
/// tetrahedra, each as high as a row. Fixed: both circles, or cylinders.
struct HubOptions {
  int rows = 24;
  double degrees = 0;
  int layers = 0;  // 0: plane
};
[[nodiscard]] MeshFile generate_hub(const HubOptions& options);

/// A bar of 1 x 1 x 4: `cells` x `cells` x 4 * `cells` cubes of six tetrahedra (Kuhn). The end
/// z = 4 is rotated by `degrees` about the axis of the bar. With given sides their nodes are
/// rotated by the share of it that z has of 4. Fixed: the ends, with given sides all of the
/// boundary.
struct BarOptions {
  int cells = 6;
  double degrees = 0;
  bool sides_given = false;
};
[[nodiscard]] MeshFile generate_bar(const BarOptions& options);

/// How the boundary of the unit cube moves; the interior stays.
struct CubeMotion {
  double squeeze = 1;  // factor of z
  double bend = 0;     // degrees from the end z = 0 to z = 1; the face x = 0 keeps its length
  double twist = 0;    // degrees from the end z = 0 to z = 1
};
/// Moves the boundary nodes of a mesh of the unit cube; one motion at most. O(nodes).
void move_cube_boundary(Mesh& mesh, const CubeMotion& motion);

/// Elements of a layer mesh; tetrahedra and triangles are cut from hexahedra and quads.
enum class LayerElements : std::uint8_t { hexahedra, wedges, tetrahedra, quads, triangles };

/// A boundary layer on a wall of length 1 (and width 1): `cells` along the wall and, last, across
/// the layer; the first layer is `first` high and each next one `growth` times as high. On top
/// are `core` layers of cells as high as they are long. The wall is z = 0, or y = 0 in the plane.
///
/// `jitter` throws the interior nodes of the layers, in each direction by up to this share of the
/// lower one of the two layers that they lie between. `tangle` throws the nodes inside the core
/// until about this share of the elements of the core is inverted. Fixed: wall and top.
struct LayerOptions {
  LayerElements elements = LayerElements::hexahedra;
  std::array<int, 3> cells = {12, 12, 20};  // in the plane the second is not used
  double first = 0.001;
  double growth = 1.25;
  double jitter = 0;
  int core = 0;
  double tangle = 0;
  std::uint64_t seed = 1;
};
[[nodiscard]] MeshFile generate_layer(const LayerOptions& options);

/// The unit cube of `cells`³ cubes of six tetrahedra, in which `count` interior nodes are pushed
/// along x by 0.999 of the way to a neighbour. They are spread over the cube, and no two have a
/// neighbour in common. Without a set of fixed nodes.
struct DamageOptions {
  int cells = 24;
  int count = 9;
};
[[nodiscard]] MeshFile generate_damage(const DamageOptions& options);

/// The channel of Turek and Hron (2006), 2.5 x 0.41, with the flap of 0.35 x 0.02 behind the
/// cylinder: triangles (Gmsh), of the size `size` at flap and cylinder, growing to 5 * `size` at
/// the walls. The flap is curved to an arc of its own length, up or, with negative values, down,
/// so that its tip rises by the share `tip` of the free height or turns by `degrees`; one of
/// them is 0. Fixed: cylinder and flap.
struct FlapOptions {
  double size = 0.01;
  double tip = 0;
  double degrees = 0;
};
[[nodiscard]] MeshFile generate_flap(const FlapOptions& options);

/// The unit cube with a spherical hole of the radius `radius` at its centre: tetrahedra (Gmsh) of
/// about the size `size`. The hole is moved along x by the share `move` of its distance to the
/// wall. Fixed: the sphere.
struct BoxSphereOptions {
  double size = 0.08;
  double radius = 0.2;
  double move = 0;
};
[[nodiscard]] MeshFile generate_box_sphere(const BoxSphereOptions& options);

}  // namespace meshsmooth::formats
