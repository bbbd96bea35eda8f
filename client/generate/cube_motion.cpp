#include "generate/case_file.hpp"
#include "generate/cases.hpp"
#include "generate/rotation.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::formats {
namespace {

bool is_on_boundary(Vec3d p) {
  const auto at_end = [](double x) { return x == 0 || x == 1; };
  return at_end(p.x) || at_end(p.y) || at_end(p.z);
}

/// Lines along z become arcs about an axis along y, on the side of negative x; that of x = 0 keeps
/// its length.
Vec3d bend(Vec3d point, double degrees) {
  const double radius = 1 / radians(degrees);
  const double angle = radians(degrees) * point.z;
  return {(radius + point.x) * std::cos(angle) - radius, point.y,
          (radius + point.x) * std::sin(angle)};
}

}  // namespace

void move_cube_boundary(Mesh& mesh, const CubeMotion& motion) {
  check_option("squeeze", motion.squeeze, 1e-3, 1e3);
  check_option("bend", motion.bend, 0, 350);
  check_option("twist", motion.twist, -3600, 3600);
  if ((motion.squeeze != 1) + (motion.bend != 0) + (motion.twist != 0) > 1) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", "squeeze, bend and twist: choose one",
                        {{"field", "squeeze, bend, twist"}});
  }
  for (Vec3d& node : std::get<std::vector<Vec3d>>(mesh.positions)) {
    if (!is_on_boundary(node)) continue;
    if (motion.squeeze != 1) node.z *= motion.squeeze;
    if (motion.bend != 0) node = bend(node, motion.bend);
    if (motion.twist != 0) node = rotated(node, {0.5, 0.5, 0}, node.z * motion.twist);
  }
}

}  // namespace meshsmooth::formats
