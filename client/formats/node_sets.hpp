#pragma once

#include <string>
#include <vector>

#include "mesh_file.hpp"

namespace meshsmooth::formats {

/// The nodes that the file gives this name, each once, ascending: those of the cells of the
/// physical groups (of any dimension) called so, those of the sets, patches and markers called so,
/// and those where the point array called so
/// has one number, which is not 0. A group without a name is called by its number. Throws
/// `InvalidOption` (NAME_UNKNOWN), which lists the names that there are. O(nodes + cells).
[[nodiscard]] std::vector<NodeId> find_node_set(const MeshFile& file, const std::string& name);

/// The names that `find_node_set` finds, each once, in the order of the file. O(names).
[[nodiscard]] std::vector<std::string> node_set_names(const MeshFile& file);

/// A point array of three numbers a node. Throws `InvalidOption` (NAME_UNKNOWN) where the file has
/// none of this name: VTK's formats can have them. O(nodes).
[[nodiscard]] std::vector<Vec3d> find_node_vectors(const MeshFile& file, const std::string& name);

}  // namespace meshsmooth::formats
