#include "generate/cases.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::formats {
namespace {

[[noreturn]] void refuse(const char* shape) {
  throw NotSupported("OPTION_NOT_SUPPORTED",
                     std::string(shape) +
                         " is made by Gmsh, which this build does not have; configure with "
                         "MESHSMOOTH_WITH_GMSH=ON");
}

}  // namespace

MeshFile generate_flap(const FlapOptions&) { refuse("flap"); }

MeshFile generate_box_sphere(const BoxSphereOptions&) { refuse("box-sphere"); }

}  // namespace meshsmooth::formats
