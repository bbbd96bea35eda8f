#include <algorithm>
#include <array>

#include "medit/model.hpp"
#include "text.hpp"

namespace meshsmooth::formats::medit {
namespace {

struct Dialect {
  std::string_view start;  // in the first lines of the file
  std::string_view name;
  std::string_view hint;
};

constexpr auto kDialects = std::to_array<Dialect>({
    {"MFEM NURBS mesh", "MFEM", "NURBS have no nodes that could be moved"},
    {"MFEM", "MFEM", "convert it to .vtu by MFEM's Mesh::PrintVTU"},
    {"BEGIN POINTS LIST", "GetFEM", "export it as .vtu or .msh by GetFEM (mesh.export_to_vtu)"},
    {"GETFEM", "GetFEM", "export it as .vtu or .msh by GetFEM (mesh.export_to_vtu)"},
    {"GetFEM", "GetFEM", "export it as .vtu or .msh by GetFEM (mesh.export_to_vtu)"},
    {"mesh3d", "Netgen", "export it as .msh by Netgen"},
    {"NETGEN", "Netgen", "export it as .msh by Netgen"},
    {"TrueGrid", "TrueGrid", "convert it to .vtu or .msh"},
    {"areamesh2", "Netgen in two dimensions", "convert it to .vtu or .msh"},
    {"$MeshFormat", "Gmsh", "name it .msh"},
    {"<?xml", "XML, perhaps of DOLFIN", "convert it to .xdmf or .msh"},
    {"[MeshSerializer", "OGRE", "convert it to .ply or .obj"},
    {"NDIME", "SU2", "name it .su2"},
    {"# vtk", "VTK", "name it .vtk"},
    {"ply\n", "PLY", "name it .ply"},
    {"version https://git-lfs", "Git LFS that points to one",
     "fetch the file itself by git lfs pull"},
});

}  // namespace

void refuse_foreign(const std::filesystem::path& file, std::string_view text) {
  constexpr std::size_t kFirstBytes = 2000;  // licences come first
  const std::string_view start = text.substr(0, kFirstBytes);
  for (const Dialect& dialect : kDialects) {
    if (start.find(dialect.start) == std::string_view::npos) continue;
    fail("FORMAT_ERROR", file,
         "this is not a mesh of Medit but a file of " + std::string(dialect.name) + "; " +
             std::string(dialect.hint));
  }
}

}  // namespace meshsmooth::formats::medit
