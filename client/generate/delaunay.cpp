#include "generate/delaunay.hpp"

#include "meshsmooth/error.hpp"

#if defined(MESHSMOOTH_WITH_TETGEN)
#define TETLIBRARY
#include <tetgen.h>

#include <string>
#endif

namespace meshsmooth::formats {

#if defined(MESHSMOOTH_WITH_TETGEN)
std::vector<NodeId> delaunay_tetrahedra(const std::vector<Vec3d>& points) {
  tetgenio input;
  tetgenio output;
  input.numberofpoints = static_cast<int>(points.size());
  input.pointlist = new REAL[3 * points.size()];  // freed by tetgenio
  for (std::size_t node = 0; node < points.size(); ++node) {
    input.pointlist[3 * node] = points[node].x;
    input.pointlist[3 * node + 1] = points[node].y;
    input.pointlist[3 * node + 2] = points[node].z;
  }
  std::string switches = "zQ";  // count from 0, quiet; no switch that refines
  try {
    tetrahedralize(switches.data(), &input, &output);
  } catch (int code) {
    throw Error("GENERATOR_FAILED", "TetGen gives up with code " + std::to_string(code));
  }
  return {output.tetrahedronlist, output.tetrahedronlist + 4 * output.numberoftetrahedra};
}
#else
std::vector<NodeId> delaunay_tetrahedra(const std::vector<Vec3d>&) {
  throw NotSupported("OPTION_NOT_SUPPORTED",
                     "this build has no TetGen; configure with MESHSMOOTH_WITH_TETGEN=ON");
}
#endif

}  // namespace meshsmooth::formats
