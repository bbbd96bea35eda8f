#include <utility>

#include "cgns/adf_file.hpp"
#include "cgns/elements.hpp"
#include "cgns/sets.hpp"
#include "cgns/tree.hpp"
#include "content.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

std::string list_of(const std::vector<std::string>& nodes) {
  std::string list;
  for (const std::string& node : nodes) list += (list.empty() ? "" : ", ") + cgns_name(node);
  return list;
}

/// The zones of the one base that has any.
std::vector<CgnsZone> find_zones(const CgnsTree& tree, const path& path) {
  std::vector<std::string> bases = tree.children("/", "CGNSBase_t");
  std::erase_if(bases,
                [&](const std::string& base) { return tree.children(base, "Zone_t").empty(); });
  if (bases.empty()) tree.fail("there is no zone in it");
  if (bases.size() > 1) {
    tree.fail("only a file with one base can be smoothed; this one has " +
              std::to_string(bases.size()) + ": " + list_of(bases));
  }
  std::vector<CgnsZone> zones;
  for (const std::string& node : tree.children(bases.front(), "Zone_t")) {
    const std::string type = node + "/ZoneType";
    if (!tree.has_data(type) || tree.text(type) != "Unstructured") {
      fail("ELEMENT_NOT_SUPPORTED", path,
           "the zone \"" + node + "\" is structured; only unstructured ones can be smoothed");
    }
    CgnsZone& zone = zones.emplace_back();
    zone.node = node;
    zone.size = tree.integers(node);
    if (zone.size.empty()) tree.fail("the zone \"" + node + "\" has no size");
  }
  return zones;
}

void read_nodes(const CgnsTree& tree, const path& path, CgnsZone& zone, FileContent& content,
                Positions& positions) {
  const std::vector<std::string> grids = tree.children(zone.node, "GridCoordinates_t");
  if (grids.size() > 1) {
    tree.fail("the zone \"" + zone.node + "\" has " + std::to_string(grids.size()) +
              " grids, a mesh that moves with time: " + list_of(grids));
  }
  const std::string grid = grids.empty() ? zone.node + "/GridCoordinates" : grids.front();
  CoordinateArrays arrays;
  std::vector<std::vector<double>> numbers;
  arrays.single_precision = true;
  for (const char* axis : {"X", "Y", "Z"}) {
    const std::string node = grid + "/Coordinate" + axis;
    if (!tree.exists(node)) break;
    arrays.names.push_back(tree.data_name(node));
    numbers.push_back(tree.reals(node));
    arrays.single_precision = arrays.single_precision && tree.is_single_precision(node);
  }
  arrays.dimension = arrays.names.size();
  if (arrays.names.empty()) {
    tree.fail("\"" + grid + "\" has no CoordinateX, CoordinateY …");
  }
  for (const CoordinateArrays& others : content.arrays) {
    if (others.names != arrays.names) continue;
    tree.fail("the zone \"" + zone.node + "\" has the coordinates of another zone");
  }
  const Positions of_zone = positions_of(path, arrays, numbers);
  arrays.first_node = content.arrays.empty()
                          ? 0
                          : content.arrays.back().first_node + content.arrays.back().node_count;
  arrays.node_count = numbers.front().size();
  zone.first_node = static_cast<std::int64_t>(arrays.first_node);
  if (zone.size.front() != static_cast<std::int64_t>(arrays.node_count)) {
    tree.fail("\"" + zone.node + "\" has not as many nodes as coordinates");
  }
  append_positions(positions, of_zone);
  content.arrays.push_back(std::move(arrays));
}

void write_adf(const path& path, const MeshFile& file) {
  const FileContent& content = *file.content();
  AdfFile changed(path, content.text);
  for (const CoordinateArrays& arrays : content.arrays) {
    const auto numbers = numbers_of(path, arrays, file.mesh.positions_view());
    for (std::size_t array = 0; array < numbers.size(); ++array) {
      changed.overwrite(arrays.names[array], numbers[array]);
    }
  }
  write_bytes(path, changed.bytes());
}

}  // namespace

MeshFile read_cgns(const path& path) {
  FileContent content;
  content.extension = ".cgns";
  content.text = read_bytes(path);
  const auto tree = open_cgns(path, content.text);
  std::vector<CgnsZone> zones = find_zones(*tree, path);
  Positions positions;
  CgnsElements elements(*tree, path);
  for (CgnsZone& zone : zones) {
    read_nodes(*tree, path, zone, content, positions);
    zone.id_offset = elements.highest_id();
    elements.read(zone, content);
  }
  const auto dataset = std::make_shared<PlainDataset>();
  dataset->set_positions(std::move(positions));
  for (std::int64_t id = 1; id <= dataset->node_count(); ++id) content.node_ids.push_back(id);
  elements.store(*dataset, content);
  for (const CgnsZone& zone : zones) {
    read_cgns_conditions(*tree, zone, elements, *dataset, content);
  }
  read_cgns_interfaces(*tree, zones, elements, *dataset, content);
  content.dataset = dataset;
  return make_mesh_file(path, std::move(content));
}

void write_cgns(const path& path, const MeshFile& file) {
  if (is_adf(file.content()->text)) {
    write_adf(path, file);
  } else {
    write_hdf5(path, file);
  }
}

}  // namespace meshsmooth::formats
