#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "mesh_file.hpp"

namespace meshsmooth::formats {

/// ".vtu", in lower case.
[[nodiscard]] std::string extension_of(const std::filesystem::path& file);

// Readers and writers; those of a library choose by the path's extension.
// Writers may leave an unfinished file behind when they throw.

[[nodiscard]] MeshFile read_vtk(const std::filesystem::path& path);
void write_vtk(const std::filesystem::path& path, const MeshFile& file);

[[nodiscard]] MeshFile read_obj(const std::filesystem::path& path);
void write_obj(const std::filesystem::path& path, const MeshFile& file);

[[nodiscard]] MeshFile read_ply(const std::filesystem::path& path);
void write_ply(const std::filesystem::path& path, const MeshFile& file);

[[nodiscard]] MeshFile read_gmsh(const std::filesystem::path& path);
void write_gmsh(const std::filesystem::path& path, const MeshFile& file);

[[nodiscard]] MeshFile read_tetgen(const std::filesystem::path& path);
void write_tetgen(const std::filesystem::path& path, const MeshFile& file);

/// The files that a writer makes for `partial`, each with the name it gets in
/// the end: one, but for TetGen's pair.
[[nodiscard]] std::vector<std::pair<std::filesystem::path, std::filesystem::path>> written_files(
    const std::filesystem::path& partial, const std::filesystem::path& target);

}  // namespace meshsmooth::formats
