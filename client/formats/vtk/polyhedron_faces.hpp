#pragma once

#include <vtkUnstructuredGrid.h>

#include <string_view>

#include "vtk/layout.hpp"

namespace meshsmooth::formats {

/// VTK 9.4 and later write the faces of polyhedra into arrays that VTK 9.1 passes over: puts them
/// into the grid that was read from the file. False: they do not fit it. O(faces).
[[nodiscard]] bool add_faces(std::string_view file, const VtkLayout& layout,
                             vtkUnstructuredGrid& grid);

}  // namespace meshsmooth::formats
