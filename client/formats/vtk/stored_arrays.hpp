#pragma once

#include <vtkPointSet.h>

#include <vector>

#include "dataset.hpp"

namespace meshsmooth::formats {

/// All arrays of points, cells and the whole, and the faces of polyhedra.
[[nodiscard]] std::vector<StoredArray> stored_arrays_of(vtkPointSet& data);

}  // namespace meshsmooth::formats
