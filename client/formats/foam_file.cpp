#include <algorithm>
#include <array>
#include <memory>
#include <system_error>
#include <utility>

#include "cells.hpp"
#include "content.hpp"
#include "foam_cells.hpp"
#include "foam_patches.hpp"
#include "foam_reader.hpp"
#include "readers.hpp"
#include "self_contained.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

class FoamMesh {
 public:
  explicit FoamMesh(path folder) : folder_(std::move(folder)) {}

  void read(FileContent& content) {
    const path points_file = foam_file(folder_, "points");
    FoamReader points(points_file);
    fields_ = points.points();
    single_ = points.scalar_width() == sizeof(float);
    faces_ = FoamReader(foam_file(folder_, "faces")).faces();
    owner_ = FoamReader(foam_file(folder_, "owner")).labels();
    neighbour_ = FoamReader(foam_file(folder_, "neighbour")).labels();
    while (!neighbour_.empty() && neighbour_.back() == -1) neighbour_.pop_back();
    patches_ = FoamReader(foam_file(folder_, "boundary")).entries();
    check();
    sort_faces();
    store(content);
    content.files.push_back(points_file);
    content.segments.push_back(whole_file(points.take_text(), std::move(fields_)));
  }

 private:
  /// All that is used as an index later.
  void check() {
    const auto node_count = static_cast<std::int64_t>(fields_.positions.size());
    const auto face_count = static_cast<std::int64_t>(faces_.size());
    for (std::size_t face = 0; face < faces_.size(); ++face) {
      if (faces_.node_count(face) < 3) refuse("faces", face, "has fewer than three nodes");
      for (std::size_t corner = 0; corner < faces_.node_count(face); ++corner) {
        const std::int64_t node = faces_.nodes_of(face)[corner];
        if (node >= 0 && node < node_count) continue;
        refuse(
            "faces", face,
            "uses node " + std::to_string(node) + ", there are only " + std::to_string(node_count));
      }
    }
    if (std::cmp_not_equal(owner_.size(), face_count)) {
      fail("FORMAT_ERROR", folder_ / "owner",
           std::to_string(owner_.size()) + " owners of " + std::to_string(face_count) + " faces");
    }
    if (std::cmp_greater(neighbour_.size(), face_count)) {
      fail("FORMAT_ERROR", folder_ / "neighbour",
           std::to_string(neighbour_.size()) + " neighbours of " + std::to_string(face_count) +
               " faces");
    }
    check_cells("owner", owner_);
    check_cells("neighbour", neighbour_);
    const auto inner_count = static_cast<std::int64_t>(neighbour_.size());
    for (const FoamEntry& patch : patches_) {
      if (patch.face_count >= 0 && patch.start_face >= inner_count &&
          patch.start_face <= face_count && patch.face_count <= face_count - patch.start_face) {
        continue;
      }
      fail("FORMAT_ERROR", folder_ / "boundary",
           "patch \"" + patch.name + "\": its " + std::to_string(patch.face_count) +
               " faces from " + std::to_string(patch.start_face) + " are not among the faces " +
               std::to_string(inner_count) + " to " + std::to_string(face_count - 1) +
               " of the boundary");
    }
  }
  [[noreturn]] void refuse(const char* file, std::size_t face, const std::string& what) const {
    fail("FORMAT_ERROR", folder_ / file, "face " + std::to_string(face) + " " + what);
  }
  /// A cell has four faces or more, so there are fewer cells than faces. -1 is no neighbour, as
  /// old versions write for faces of the boundary; at the end they are dropped.
  void check_cells(const char* file, const std::vector<std::int64_t>& cells) {
    const bool none_is_known = &cells == &neighbour_;
    for (std::size_t face = 0; face < cells.size(); ++face) {
      const std::int64_t cell = cells[face];
      if (cell == -1 && none_is_known) continue;
      if (cell < 0 || std::cmp_greater_equal(cell, faces_.size())) {
        refuse(file, face, "belongs to cell " + std::to_string(cell) + ", which cannot be");
      }
      cell_count_ = std::max(cell_count_, static_cast<std::size_t>(cell) + 1);
    }
  }

  /// By cell.
  void sort_faces() {
    first_.assign(cell_count_ + 1, 0);
    const auto for_each = [&](auto action) {
      for (std::size_t face = 0; face < owner_.size(); ++face) {
        const auto id = static_cast<std::int64_t>(face);
        action(owner_[face], FoamCellFace{id, false});
        if (face < neighbour_.size() && neighbour_[face] >= 0) {
          action(neighbour_[face], FoamCellFace{id, true});
        }
      }
    };
    for_each([&](std::int64_t cell, const FoamCellFace&) {
      ++first_[static_cast<std::size_t>(cell) + 1];
    });
    for (std::size_t cell = 0; cell < cell_count_; ++cell) {
      if (first_[cell + 1] == 0) {
        fail("FORMAT_ERROR", folder_ / "owner", "cell " + std::to_string(cell) + " has no faces");
      }
      first_[cell + 1] += first_[cell];
    }
    cell_faces_.resize(first_.back());
    std::vector<std::size_t> next = first_;
    for_each([&](std::int64_t cell, const FoamCellFace& face) {
      cell_faces_[next[static_cast<std::size_t>(cell)]++] = face;
    });
  }

  void store(FileContent& content) {
    auto dataset = std::make_shared<PlainDataset>();
    Cell cell;
    for (std::size_t id = 0; id < cell_count_; ++id) {
      recognize_cell(faces_,
                     std::span(cell_faces_).subspan(first_[id], first_[id + 1] - first_[id]), cell);
      dataset->add_cell(cell.type, cell.nodes);
    }
    store_patches(content, *dataset);
    store_zones(content, *dataset);
    if (single_) {
      std::vector<Vec3f> positions;
      for (const Vec3d& position : fields_.positions)
        positions.push_back(vec3_cast<float>(position));
      dataset->set_positions(std::move(positions));
    } else {
      dataset->set_positions(fields_.positions);
    }
    content.dataset = std::move(dataset);
  }

  /// Their triangles and quads become lower-dimensional cells; of other faces, the nodes do.
  void store_patches(FileContent& content, PlainDataset& dataset) {
    Column column{kPatchArray, true, std::vector<double>(cell_count_, 0)};
    for (std::size_t index = 0; index < patches_.size(); ++index) {
      const FoamEntry& patch = patches_[index];
      for (std::int64_t id = patch.start_face; id < patch.start_face + patch.face_count; ++id) {
        const auto face = static_cast<std::size_t>(id);
        const std::size_t size = faces_.node_count(face);
        const int type = size == 3 ? kTriangleCell : size == 4 ? kQuadCell : kPolyVertexCell;
        dataset.add_cell(type, {faces_.nodes_of(face), size});
        column.values.push_back(static_cast<double>(index + 1));
      }
    }
    facet_count_ = column.values.size() - cell_count_;
    if (facet_count_ > 0) dataset.add_cell_column(std::move(column));
    add_patch_sets(faces_, patches_, content);
    bind_patches(faces_, patches_, fields_.positions, content);
  }

  void store_zones(FileContent& content, PlainDataset& dataset) const {
    std::error_code error;
    const auto zones = [&](const char* file, std::size_t limit) {
      std::vector<FoamEntry> found;
      const path zone_file = foam_file(folder_, file);
      if (!std::filesystem::exists(zone_file, error)) return found;
      found = FoamReader(zone_file).entries();
      for (const FoamEntry& zone : found) {
        for (const std::int64_t label : zone.labels) {
          if (label >= 0 && std::cmp_less(label, limit)) continue;
          fail("FORMAT_ERROR", folder_ / file,
               "zone \"" + zone.name + "\" has " + std::to_string(label) + ", there are only " +
                   std::to_string(limit));
        }
      }
      return found;
    };
    for (const FoamEntry& zone : zones("pointZones", fields_.positions.size())) {
      content.node_sets.push_back({zone.name, {zone.labels.begin(), zone.labels.end()}});
    }
    for (const FoamEntry& zone : zones("faceZones", faces_.size())) {
      NodeSet set{zone.name, {}};
      for (const std::int64_t face : zone.labels) {
        const std::vector<NodeId> nodes = nodes_of_faces(faces_, face, 1);
        set.nodes.insert(set.nodes.end(), nodes.begin(), nodes.end());
        set.facets.add(nodes, nodes.size());
      }
      content.node_sets.push_back(std::move(set));
    }
    const std::vector<FoamEntry> cell_zones = zones("cellZones", cell_count_);
    if (cell_zones.empty()) return;
    Column column{kCellZoneArray, true, std::vector<double>(cell_count_ + facet_count_, 0)};
    Cell cell;
    for (std::size_t index = 0; index < cell_zones.size(); ++index) {
      NodeSet set{cell_zones[index].name, {}};
      for (const std::int64_t id : cell_zones[index].labels) {
        column.values[static_cast<std::size_t>(id)] = static_cast<double>(index + 1);
        dataset.get_cell(id, cell);
        for (const std::int64_t node : cell.nodes) set.nodes.push_back(static_cast<NodeId>(node));
      }
      content.node_sets.push_back(std::move(set));
    }
    dataset.add_cell_column(std::move(column));
  }

  path folder_;
  CoordinateFields fields_;
  bool single_ = false;
  FoamFaces faces_;
  std::vector<std::int64_t> owner_;
  std::vector<std::int64_t> neighbour_;
  std::vector<FoamEntry> patches_;
  std::size_t cell_count_ = 0;
  std::size_t facet_count_ = 0;
  std::vector<std::size_t> first_;  // of each cell in `cell_faces_`, and the end
  std::vector<FoamCellFace> cell_faces_;
};

}  // namespace

path poly_mesh_folder(const path& given) {
  const bool slash = !given.empty() && given.filename().empty();  // "case/"
  const path file = slash ? given.parent_path() : given;
  std::error_code error;
  if (file.filename() == "polyMesh") return file;
  if (slash || std::filesystem::is_directory(file / "constant", error) ||
      std::filesystem::is_directory(file / "system", error)) {
    return file / "constant" / "polyMesh";
  }
  if (extension_of(file) == ".foam") return file.parent_path() / "constant" / "polyMesh";
  return {};
}

MeshFile read_foam(const path& file) {
  check_reference(file, "constant/polyMesh/points");
  const path folder = poly_mesh_folder(file);
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    fail("FILE_NOT_READABLE", file,
         "this is no OpenFOAM case: there is no folder " + folder.string());
  }
  FileContent content;
  content.extension = ".foam";
  FoamMesh mesh(folder);
  mesh.read(content);
  return make_mesh_file(file, std::move(content));
}

}  // namespace meshsmooth::formats
