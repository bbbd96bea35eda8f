#pragma once

#include <cstdint>
#include <vector>

#include "content.hpp"
#include "foam_reader.hpp"

namespace meshsmooth::formats {

/// The nodes of faces from `first` on, one face after the other.
[[nodiscard]] std::vector<NodeId> nodes_of_faces(const FoamFaces& faces, std::int64_t first,
                                                 std::int64_t count);

/// Patches, and groups of patches that have not the name of one, as sets of nodes.
void add_patch_sets(const FoamFaces& faces, const std::vector<FoamEntry>& patches,
                    FileContent& content);

/// What must not move without breaking the case: the nodes of patches that are planes of a case in
/// two dimensions or partners of a patch of another part stay; those of cyclic patches are pairs.
/// Where the nodes of two cyclic patches do not match, as those of cyclicAMI need not, each stays
/// for itself, with a note.
void bind_patches(const FoamFaces& faces, const std::vector<FoamEntry>& patches,
                  const std::vector<Vec3d>& positions, FileContent& content);

}  // namespace meshsmooth::formats
