#pragma once

#include <optional>
#include <string_view>

namespace meshsmooth::formats {

/// What an element type of Abaqus or CalculiX is to a mesh.
struct AbaqusElement {
  int vtk_type;    // kPolyVertexCell: any nodes, which its line lists
  int node_count;  // 0: as many as the line has
};

/// By the type's name in capitals: "C3D8R". None: not known here.
[[nodiscard]] std::optional<AbaqusElement> find_abaqus_element(std::string_view type);

}  // namespace meshsmooth::formats
