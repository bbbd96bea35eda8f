#pragma once

#include "job_command.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/options.hpp"
#include "regions.hpp"

namespace meshsmooth::cli {

/// Marks the nodes that the caller names as fixed.
void fix_named_nodes(formats::MeshFile& file, const JobFlags& flags);

/// What follows from the file and the options: marks the nodes of lower-dimensional cells as fixed,
/// unless the boundary may move, and gives the mesh its regions, which it returns. Throws
/// `InvalidOption` (OPTION_MISPLACED, NAME_UNKNOWN, ARRAY_NOT_WHOLE).
formats::Regions set_up_mesh(formats::MeshFile& file, const JobFlags& flags,
                             const SmoothOptions& options);

}  // namespace meshsmooth::cli
