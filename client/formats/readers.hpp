#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
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

/// A format: how it is read and written; a null pointer: not at all. `library`
/// is what this build would need to know it, where it does not. `cell_arrays`: the
/// writer writes `MeshFile::element_quality`.
struct Format {
  std::string_view extension;
  MeshFile (*read)(const std::filesystem::path&);
  void (*write)(const std::filesystem::path&, const MeshFile&);
  std::string_view library = {};
  bool cell_arrays = false;
};

#if defined(MESHSMOOTH_WITH_VTK)
constexpr Format vtk_format(std::string_view extension) {
  return {extension, read_vtk, write_vtk, {}, extension != ".stl"};
}
#else
constexpr Format vtk_format(std::string_view extension) {
  return {extension, nullptr, nullptr, "VTK"};
}
#endif

#if defined(MESHSMOOTH_WITH_GMSH)
constexpr Format gmsh_format(std::string_view extension) {
  return {extension, read_gmsh, write_gmsh};
}
inline constexpr Format kAbaqus = {".inp", nullptr, write_gmsh};
#else
constexpr Format gmsh_format(std::string_view extension) {
  return {extension, nullptr, nullptr, "Gmsh"};
}
inline constexpr Format kAbaqus = gmsh_format(".inp");
#endif

/// All formats; a new one is one more row.
///
///   extension    library  precision  carries besides the mesh
///   .vtu         VTK      f32, f64   point, cell and field data, lower-dimensional cells
///   .vtk         VTK      f32, f64   the same; binary is written
///   .vtp         VTK      f32, f64   the same, surfaces only
///   .ply         own      f32, f64   all other bytes; surfaces only
///   .obj         own      f64        all other bytes; surfaces only
///   .stl         VTK      f32        nothing; triangles only
///   .msh         Gmsh     f64        all other bytes; versions 2 and 4.1
///   .mesh        Gmsh     f64        all other bytes; no wedges, no pyramids
///   .unv         Gmsh     f64        all other bytes; no pyramids
///   .bdf .nas    Gmsh     columns    all other bytes; digits as the columns allow
///   .inp         Gmsh     f64        written only: ids, element sets; no pyramids
///   .node .ele   own      f64        all other bytes; tetrahedra only
inline constexpr auto kFormats = std::to_array<Format>({vtk_format(".vtu"),
                                                        vtk_format(".vtk"),
                                                        vtk_format(".vtp"),
                                                        {".ply", read_ply, write_ply},
                                                        vtk_format(".stl"),
                                                        {".obj", read_obj, write_obj},
                                                        gmsh_format(".msh"),
                                                        gmsh_format(".mesh"),
                                                        gmsh_format(".unv"),
                                                        gmsh_format(".bdf"),
                                                        gmsh_format(".nas"),
                                                        kAbaqus,
                                                        {".node", read_tetgen, write_tetgen},
                                                        {".ele", read_tetgen, write_tetgen}});

/// The files that a writer makes for `partial`, each with the name it gets in
/// the end: one, but for TetGen's pair.
[[nodiscard]] std::vector<std::pair<std::filesystem::path, std::filesystem::path>> written_files(
    const std::filesystem::path& partial, const std::filesystem::path& target);

}  // namespace meshsmooth::formats
