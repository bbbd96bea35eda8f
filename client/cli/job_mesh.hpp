#pragma once

#include <vector>

#include "inner_cells.hpp"
#include "job_command.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/options.hpp"
#include "regions.hpp"

namespace meshsmooth::cli {

/// Marks the nodes that the caller names as fixed.
void fix_named_nodes(formats::MeshFile& file, const JobFlags& flags);

/// The pairs of nodes that the file names, unless they are ignored, and those on the sides that the
/// caller names as periodic. Throws `InvalidOption` (NAME_UNKNOWN, PERIODIC_MISMATCH).
[[nodiscard]] std::vector<NodePair> find_node_pairs(const formats::MeshFile& file,
                                                    const JobFlags& flags);

/// What the file told of a mesh.
struct MeshParts {
  formats::Regions regions;
  formats::InnerCells inner;  // where the boundary may move
};

/// What follows from the file and the policy of the boundary: gives the mesh its regions, and marks
/// the nodes of lower-dimensional cells as fixed; where the boundary may move, those inside the
/// mesh alone. Throws `InvalidOption` (OPTION_MISPLACED, NAME_UNKNOWN, ARRAY_NOT_WHOLE).
MeshParts set_up_mesh(formats::MeshFile& file, const JobFlags& flags, const JobInput& input,
                      BoundaryPolicy boundary);

}  // namespace meshsmooth::cli
