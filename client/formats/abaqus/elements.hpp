#pragma once

#include <string_view>

namespace meshsmooth::formats {

/// What an element type of Abaqus or CalculiX is to a mesh.
struct AbaqusElement {
  int vtk_type;        // kPolyVertexCell: any nodes, which its line lists; kFirstOwnCellType: held
  int node_count;      // 0: as many as its lines have
  bool shell = false;  // a surface in space, whose sides 1 and 2 are its faces
};

/// By the type's name in capitals: "C3D8R". Types that are not known here, and those that are no
/// elements of a mesh (network, user, cohesive, gasket, infinite elements), are held.
[[nodiscard]] AbaqusElement find_abaqus_element(std::string_view type);

}  // namespace meshsmooth::formats
