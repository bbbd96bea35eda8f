#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "formats/mesh_file.hpp"

namespace meshsmooth::formats {

/// The file of a generated mesh with the point array `kFixedArray` unless `fixed` is empty, and
/// the cell array `kLayerArray` unless `layers` is empty. O(nodes + elements).
[[nodiscard]] MeshFile make_case_file(Mesh mesh, const std::vector<std::uint8_t>& fixed,
                                      const std::vector<std::int32_t>& layers = {});

/// Throws `InvalidOption` (OPTION_OUT_OF_RANGE) unless the value is in [lower, upper]:
/// "rows 0 is not in [1, 5000]".
void check_option(const std::string& field, double value, double lower, double upper);

/// Throws `InvalidOption` (OPTION_OUT_OF_RANGE), which names the options to reduce, for a mesh of
/// more than 10⁸ nodes.
void check_mesh_size(double node_count, const std::string& fields);

}  // namespace meshsmooth::formats
