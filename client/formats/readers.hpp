#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>

#include "mesh_file.hpp"
#include "output_files.hpp"

namespace meshsmooth::formats {

/// ".vtu" of "part.VTU" and "part.vtu.gz".
[[nodiscard]] std::string extension_of(const std::filesystem::path& file);

// Readers and writers; those of a library choose by the path's extension.
// Writers may leave an unfinished file behind when they throw.

[[nodiscard]] MeshFile read_vtk(const std::filesystem::path& path);
void write_vtk(const std::filesystem::path& path, const MeshFile& file);

[[nodiscard]] MeshFile read_obj(const std::filesystem::path& path);
void write_obj(const std::filesystem::path& path, const MeshFile& file);

[[nodiscard]] MeshFile read_ply(const std::filesystem::path& path);
void write_ply(const std::filesystem::path& path, const MeshFile& file);

[[nodiscard]] MeshFile read_stl(const std::filesystem::path& path);
void write_stl(const std::filesystem::path& path, const MeshFile& file);

[[nodiscard]] MeshFile read_msh(const std::filesystem::path& path);
/// Of a file that was read as MSH only.
void write_msh(const std::filesystem::path& path, const MeshFile& file);

void write_gmsh(const std::filesystem::path& path, const MeshFile& file);

[[nodiscard]] MeshFile read_unv(const std::filesystem::path& path);
void write_unv(const std::filesystem::path& path, const MeshFile& file);

/// Text (.mesh) or binary (.meshb).
[[nodiscard]] MeshFile read_medit(const std::filesystem::path& path);
void write_medit(const std::filesystem::path& path, const MeshFile& file);

[[nodiscard]] MeshFile read_tetgen(const std::filesystem::path& path);

[[nodiscard]] MeshFile read_med(const std::filesystem::path& path);
[[nodiscard]] MeshFile read_cgns(const std::filesystem::path& path);
void write_cgns(const std::filesystem::path& path, const MeshFile& file);
/// Of files that are HDF5.
void write_hdf5(const std::filesystem::path& path, const MeshFile& file);

[[nodiscard]] MeshFile read_exodus(const std::filesystem::path& path);
void write_exodus(const std::filesystem::path& path, const MeshFile& file);

// These write `target` and what belongs to it under the names that `files` gives.

void write_tetgen(const std::filesystem::path& target, const MeshFile& file, OutputFiles& files);

[[nodiscard]] MeshFile read_abaqus(const std::filesystem::path& path);
void write_abaqus(const std::filesystem::path& target, const MeshFile& file, OutputFiles& files);

/// Also of bulk data alone. Another format becomes a deck in large fields.
[[nodiscard]] MeshFile read_nastran(const std::filesystem::path& path);
void write_nastran(const std::filesystem::path& target, const MeshFile& file, OutputFiles& files);

[[nodiscard]] MeshFile read_su2(const std::filesystem::path& path);
void write_su2(const std::filesystem::path& path, const MeshFile& file);

/// `path` names a case: its folder, its polyMesh folder or a .foam file in it.
[[nodiscard]] MeshFile read_foam(const std::filesystem::path& path);
void write_foam(const std::filesystem::path& target, const MeshFile& file, OutputFiles& files);
/// The polyMesh folder of the case that a path names, be it there or not; empty: it names none.
[[nodiscard]] std::filesystem::path poly_mesh_folder(const std::filesystem::path& path);

[[nodiscard]] MeshFile read_xdmf(const std::filesystem::path& path);
void write_xdmf(const std::filesystem::path& target, const MeshFile& file, OutputFiles& files);

/// A format: how it is read and written; a null pointer: not at all. `library`
/// is what this build would need to know it or to write it from other formats. `cell_arrays`: the
/// writer writes `MeshFile::element_quality`. `write_all`, where one file does not hold all,
/// takes the place of `write`. `only_changed`: a file is written from one that was read in the same
/// format only. `is_case`: a path names an OpenFOAM case, be it a folder (`poly_mesh_folder`).
/// `companion`: without which the file is no mesh. Readers of formats with `write_all` get the
/// caller's path as it is, whatever it is called, and read by `read_bytes`; all others get a plain
/// file with the extension.
struct Format {
  std::string_view extension;
  MeshFile (*read)(const std::filesystem::path&);
  void (*write)(const std::filesystem::path&, const MeshFile&);
  std::string_view library = {};
  bool cell_arrays = false;
  void (*write_all)(const std::filesystem::path&, const MeshFile&, OutputFiles&) = nullptr;
  bool only_changed = false;
  bool is_case = false;
  std::string_view companion = {};

  [[nodiscard]] constexpr bool is_written() const {
    return write != nullptr || write_all != nullptr;
  }
};

constexpr Format several_files(std::string_view extension, decltype(Format::read) read,
                               decltype(Format::write_all) write, std::string_view companion = {},
                               bool only_changed = false) {
  return {extension, read, nullptr, {}, false, write, only_changed, false, companion};
}

#if defined(MESHSMOOTH_WITH_VTK)
constexpr Format vtk_format(std::string_view extension) {
  return {extension, read_vtk, write_vtk, {}, true};
}
#else
constexpr Format vtk_format(std::string_view extension) {
  return {extension, nullptr, nullptr, "VTK"};
}
#endif

#if defined(MESHSMOOTH_WITH_GMSH)
inline constexpr Format kMsh = {".msh", read_msh, write_gmsh};
#else
inline constexpr Format kMsh = {".msh", read_msh, write_msh, "Gmsh", false, nullptr, true};
#endif

#if defined(MESHSMOOTH_WITH_HDF5)
inline constexpr Format kMed = {".med", read_med, write_hdf5, {}, false, nullptr, true};
inline constexpr Format kCgns = {".cgns", read_cgns, write_cgns, {}, false, nullptr, true};
inline constexpr Format kXdmf = several_files(".xdmf", read_xdmf, write_xdmf, "an HDF5 file", true);
constexpr Format exodus_format(std::string_view extension) {
  return {extension, read_exodus, write_exodus, {}, false, nullptr, true};
}
#else
inline constexpr Format kMed = {".med", nullptr, nullptr, "HDF5"};
inline constexpr Format kCgns = {".cgns", nullptr, nullptr, "HDF5"};
inline constexpr Format kXdmf = {".xdmf", nullptr, nullptr, "HDF5"};
constexpr Format exodus_format(std::string_view extension) {
  return {extension, nullptr, nullptr, "HDF5"};
}
#endif

inline constexpr Format kFoam = {".foam", read_foam,          nullptr, {}, false, write_foam, true,
                                 true,    "a polyMesh folder"};

/// All formats; a new one is one more row.
///
///   extension    library  precision  carries besides the mesh
///   .vtu         VTK      f32, f64   all other bytes; with cell arrays written by VTK
///   .vtk         VTK      f32, f64   the same
///   .vtp         VTK      f32, f64   the same, surfaces only
///   .ply         own      f32, f64   all other bytes; surfaces only
///   .obj         own      f64        all other bytes; surfaces only
///   .stl         own      f32        all other bytes; triangles only
///   .msh         own      f64        all other bytes; versions 1, 2, 4.0 and 4.1; another format
///                                    becomes one by Gmsh
///   .mesh        own      f64        all other bytes
///   .meshb       own      f32, f64   the same
///   .unv         own      f64        all other bytes; pyramids are not written
///   .bdf .nas    own      columns    all other bytes, also of included files; digits as the
///   columns
///                                    allow
///   .inp         own      f64        all other bytes, also of included files; another format
///                                    becomes one by Gmsh: ids, element sets; no pyramids
///   .su2         own      f64        all other bytes
///   .foam        own      f32, f64   all other bytes; written only from OpenFOAM; also the
///                                    case's folder or its polyMesh folder
///   .node .ele   own      f64        all other bytes; tetrahedra only
///   .med .cgns   HDF5     f32, f64   everything; written from the same format only
///   .exo .e .g .ex2  netCDF  f32, f64  the same
///   .xdmf        HDF5     f32, f64   the same; with its .h5 file
inline constexpr auto kFormats =
    std::to_array<Format>({vtk_format(".vtu"),
                           vtk_format(".vtk"),
                           vtk_format(".vtp"),
                           {".ply", read_ply, write_ply},
                           {".stl", read_stl, write_stl},
                           {".obj", read_obj, write_obj},
                           kMsh,
                           {".mesh", read_medit, write_medit},
                           {".meshb", read_medit, write_medit},
                           {".unv", read_unv, write_unv},
                           several_files(".bdf", read_nastran, write_nastran),
                           several_files(".nas", read_nastran, write_nastran),
                           several_files(".inp", read_abaqus, write_abaqus),
                           {".su2", read_su2, write_su2},
                           kFoam,
                           several_files(".node", read_tetgen, write_tetgen, "an .ele file"),
                           several_files(".ele", read_tetgen, write_tetgen, "a .node file"),
                           kMed,
                           kCgns,
                           exodus_format(".exo"),
                           exodus_format(".e"),
                           exodus_format(".g"),
                           exodus_format(".ex2"),
                           kXdmf});

}  // namespace meshsmooth::formats
