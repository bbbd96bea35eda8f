#include "cgns/elements.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iterator>
#include <span>
#include <utility>

#include "cgns/parents.hpp"
#include "cgns/types.hpp"
#include "foam_cells.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

constexpr std::int64_t kMostElements = std::int64_t{1} << 40;  // so that no sum overflows
/// Up to version 2 a polygon's type is 21 and its number of nodes.
std::size_t old_polygon_size(std::int64_t type) {
  constexpr std::int64_t kMost = 1 << 20;
  return type > kCgnsOldPolygons && type < kMost ? static_cast<std::size_t>(type - kCgnsOldPolygons)
                                                 : 0;
}

}  // namespace

CgnsElements::CgnsElements(const CgnsTree& tree, std::filesystem::path path)
    : tree_(tree), path_(std::move(path)) {
  constexpr const char* kVersion = "/CGNSLibraryVersion";
  if (!tree.has_data(kVersion)) return;
  const std::vector<double> version = tree.reals(kVersion);
  before_version_3_ = !version.empty() && version.front() < 3.0 - 1e-6;
}

void CgnsElements::read(const CgnsZone& zone, FileContent& content) {
  ++zone_number_;
  first_node_ = 1 - zone.first_node;
  const std::vector<CgnsSection> sections = find_sections(zone);
  const std::size_t before = dimensions_.size();
  const bool has_polyhedra =
      std::ranges::find(sections, kCgnsPolyhedra, &CgnsSection::type) != sections.end();
  for (const CgnsSection& section : sections) {
    highest_id_ = section.last + zone.id_offset;
    if (has_polyhedra && section.type == kCgnsPolygons) add_faces(zone, section);
  }
  std::array<bool, 4> dimensions{};
  for (const CgnsSection& section : sections) {
    if (has_polyhedra && section.type == kCgnsPolygons) continue;
    const std::size_t first = dimensions_.size();
    ++section_number_;
    read_section(zone, section, content);
    std::array<bool, 4> here{};
    for (std::size_t cell = first; cell < dimensions_.size(); ++cell) {
      here[static_cast<std::size_t>(dimensions_[cell])] = true;
    }
    for (int dimension = 0; dimension < 4; ++dimension) {
      if (!here[static_cast<std::size_t>(dimension)]) continue;
      dimensions[static_cast<std::size_t>(dimension)] = true;
      content.groups.push_back({dimension, section.name, kSectionArray, {section_number_}});
    }
  }
  zone_column_.values.resize(dimensions_.size(), zone_number_);
  const auto first = dimensions_.begin() + static_cast<std::ptrdiff_t>(before);
  const auto highest = std::max_element(first, dimensions_.end());
  const auto cells =
      highest == dimensions_.end() ? 0 : std::count(first, dimensions_.end(), *highest);
  if (zone.size.size() > 1 && cells < zone.size[1]) {
    tree_.fail("the zone \"" + zone.node + "\" has " + std::to_string(zone.size[1]) +
               " elements by its size, its sections have " + std::to_string(cells));
  }
  for (int dimension = 0; dimension < 4; ++dimension) {
    if (!dimensions[static_cast<std::size_t>(dimension)]) continue;
    content.groups.push_back({dimension, cgns_name(zone.node), kZoneArray, {zone_number_}});
  }
}

void CgnsElements::store(PlainDataset& dataset, FileContent& content) {
  cells_.store(dataset);
  dataset.add_cell_column(std::move(section_column_));
  if (zone_number_ > 1) {
    dataset.add_cell_column(std::move(zone_column_));
  } else {
    std::erase_if(content.groups, [](const CellGroup& group) { return group.array == kZoneArray; });
  }
}

std::vector<CgnsSection> CgnsElements::find_sections(const CgnsZone& zone) const {
  std::vector<CgnsSection> sections;
  for (const std::string& node : tree_.children(zone.node, "Elements_t")) {
    const std::string name = cgns_name(node);
    const std::vector<std::int64_t> type = tree_.integers(node);
    if (type.empty()) tree_.fail("section \"" + name + "\" has no type");
    const auto [first, last] = tree_.range(node + "/ElementRange");
    if (last > kMostElements) tree_.fail("\"" + node + "/ElementRange\" is no range");
    sections.push_back({name, node, type.front(), first, last});
    if (before_version_3_ && type.front() == kCgnsOldPolygons) sections.back().type = kCgnsPolygons;
  }
  std::ranges::sort(sections, {}, &CgnsSection::first);
  for (std::size_t place = 1; place < sections.size(); ++place) {
    if (sections[place].first > sections[place - 1].last) continue;
    tree_.fail("sections \"" + sections[place - 1].name + "\" and \"" + sections[place].name +
               "\" have elements of the same numbers");
  }
  return sections;
}

void CgnsElements::read_section(const CgnsZone& zone, const CgnsSection& section,
                                FileContent& content) {
  if (section.type == kCgnsPolygons) {
    const FoamFaces polygons = rows_of(section);
    check_nodes(zone, section, polygons.nodes);
    read_polygons(section, polygons);
  } else if (section.type == kCgnsPolyhedra) {
    read_polyhedra(zone, section);
  } else {
    std::vector<std::int64_t> stream = tree_.integers(section.node + "/ElementConnectivity");
    if (is_given_by_parents(tree_, section, stream)) {
      stream = connectivity_by_parents(tree_, find_sections(zone), section);
    }
    std::size_t place = 0;
    std::int64_t left = section.size();
    for (; place < stream.size() && left > 0; --left) {
      const std::int64_t type = section.type == kCgnsMixed ? stream[place++] : section.type;
      const CellKind* kind = find_cgns_kind(type);
      const std::size_t corners = before_version_3_ && type >= kCgnsOldPolygons
                                      ? old_polygon_size(type)
                                  : kind == nullptr ? std::size_t{0}
                                                    : static_cast<std::size_t>(kind->node_count);
      if (corners == 0) {
        fail("ELEMENT_NOT_SUPPORTED", path_,
             "section \"" + section.name + "\" has elements of the type " + cgns_type_name(type) +
                 "; " + kSupportedElements);
      }
      if (corners > stream.size() - place) break;
      const auto nodes = std::span(stream).subspan(place, corners);
      check_nodes(zone, section, nodes);
      add_cell(type, section, nodes);
      place += corners;
    }
    if (place != stream.size() || left != 0) refuse_size(section);
  }
  for (std::int64_t id = section.first; id <= section.last; ++id) {
    content.cell_ids.push_back(id + zone.id_offset);
  }
  section_column_.values.resize(cells_.size(), section_number_);
}

void CgnsElements::add_cell(std::int64_t type, const CgnsSection& section,
                            std::span<const std::int64_t> nodes) {
  const bool polygon = before_version_3_ && type >= kCgnsOldPolygons;
  if (polygon) {
    read_polygons(section,
                  {{0, static_cast<std::int64_t>(nodes.size())}, {nodes.begin(), nodes.end()}});
    return;
  }
  const CellKind& kind = *find_cgns_kind(type);
  cells_.add(kind, NodeOrder::cgns, nodes, first_node_);
  dimensions_.push_back(kind.dimension);
}

void CgnsElements::read_polygons(const CgnsSection& section, const FoamFaces& polygons) {
  for (std::size_t row = 0; row < polygons.size(); ++row) {
    const std::span nodes(polygons.nodes_of(row), polygons.node_count(row));
    if (nodes.size() < 3) {
      tree_.fail("section \"" + section.name + "\" has a polygon of " +
                 std::to_string(nodes.size()) + " nodes");
    }
    if (const CellKind* kind = find_vtk_cell(kPolygonCell, nodes.size())) {
      cells_.add(*kind, NodeOrder::vtk, nodes, first_node_);
    } else {
      cells_.add(kPolygonCell, nodes, first_node_);
    }
    dimensions_.push_back(2);
  }
}

void CgnsElements::read_polyhedra(const CgnsZone& zone, const CgnsSection& section) {
  const FoamFaces rows = rows_of(section);
  Cell cell;
  std::vector<FoamCellFace> faces;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    faces.clear();
    for (std::size_t index = 0; index < rows.node_count(row); ++index) {
      const std::int64_t signed_id = rows.nodes_of(row)[index];
      const bool possible = signed_id >= -kMostElements && signed_id <= kMostElements;
      const std::int64_t face = possible ? find_face(std::abs(signed_id) + zone.id_offset) : -1;
      if (face < 0) {
        tree_.fail("section \"" + section.name + "\": element " +
                   std::to_string(section.first + static_cast<std::int64_t>(row)) + " has face " +
                   std::to_string(signed_id) + ", which is in no section of polygons");
      }
      faces.push_back({face, signed_id < 0});
    }
    recognize_cell(faces_, faces, cell);
    if (const CellKind* kind = find_vtk_cell(cell.type)) {
      cells_.add(*kind, NodeOrder::vtk, cell.nodes, 0);
    } else {
      cells_.add(kPolyhedronCell, cell.nodes, 0);
    }
    dimensions_.push_back(3);
  }
}

/// The elements of a section, each with its nodes or faces. From version 4 of CGNS on, where they
/// begin is an array of its own; before, their numbers stood between them.
FoamFaces CgnsElements::rows_of(const CgnsSection& section) const {
  FoamFaces rows;
  std::vector<std::int64_t> stream = tree_.integers(section.node + "/ElementConnectivity");
  const std::string offsets = section.node + "/ElementStartOffset";
  if (tree_.has_data(offsets)) {
    rows.first = tree_.integers(offsets);
    rows.nodes = std::move(stream);
    const bool ascending = std::ranges::is_sorted(rows.first);
    if (rows.first.empty() || rows.first.front() != 0 || !ascending ||
        rows.first.back() != static_cast<std::int64_t>(rows.nodes.size())) {
      tree_.fail("\"" + offsets + "\" does not fit the connectivity");
    }
  } else {
    for (std::size_t place = 0; place < stream.size();) {
      const std::int64_t count = stream[place++];
      if (count < 1 || count > static_cast<std::int64_t>(stream.size() - place)) {
        refuse_size(section);
      }
      const auto begin = stream.begin() + static_cast<std::ptrdiff_t>(place);
      rows.nodes.insert(rows.nodes.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
      rows.first.push_back(static_cast<std::int64_t>(rows.nodes.size()));
      place += static_cast<std::size_t>(count);
    }
  }
  if (static_cast<std::int64_t>(rows.size()) != section.size()) refuse_size(section);
  return rows;
}

void CgnsElements::add_faces(const CgnsZone& zone, const CgnsSection& section) {
  const FoamFaces rows = rows_of(section);
  check_nodes(zone, section, rows.nodes);
  face_ranges_.push_back({section.first + zone.id_offset, section.last + zone.id_offset,
                          static_cast<std::int64_t>(faces_.size())});
  const auto offset = static_cast<std::int64_t>(faces_.nodes.size());
  for (std::size_t row = 1; row < rows.first.size(); ++row) {
    faces_.first.push_back(rows.first[row] + offset);
  }
  for (const std::int64_t node : rows.nodes) faces_.nodes.push_back(node - first_node_);
}

/// -1: there is none.
std::int64_t CgnsElements::find_face(std::int64_t id) const {
  const auto after = std::ranges::upper_bound(face_ranges_, id, {}, &FaceRange::first);
  if (after == face_ranges_.begin()) return -1;
  const FaceRange& range = *std::prev(after);
  return id > range.last ? -1 : range.place + id - range.first;
}

void CgnsElements::check_nodes(const CgnsZone& zone, const CgnsSection& section,
                               std::span<const std::int64_t> nodes) const {
  for (const std::int64_t node : nodes) {
    if (node >= 1 && node <= zone.size.front()) continue;
    tree_.fail("section \"" + section.name + "\" uses node " + std::to_string(node) +
               ", there are only " + std::to_string(zone.size.front()));
  }
}

void CgnsElements::refuse_size(const CgnsSection& section) const {
  tree_.fail("\"" + section.node + "\" has not the nodes of elements " +
             std::to_string(section.first) + " to " + std::to_string(section.last));
}

Cell CgnsElements::find(const std::string& node, const CgnsZone& zone, std::int64_t id,
                        const FileContent& content, const PlainDataset& dataset) const {
  const std::int64_t of_all = id < 1 || id > kMostElements ? -1 : id + zone.id_offset;
  const auto found = std::ranges::lower_bound(content.cell_ids, of_all);
  Cell cell;
  if (found != content.cell_ids.end() && *found == of_all) {
    dataset.get_cell(found - content.cell_ids.begin(), cell);
    return cell;
  }
  const std::int64_t face = find_face(of_all);
  if (face < 0) {
    tree_.fail("\"" + node + "\" names element " + std::to_string(id) + ", which does not exist");
  }
  const auto place = static_cast<std::size_t>(face);
  cell.type = kPolygonCell;
  cell.nodes.assign(faces_.nodes_of(place), faces_.nodes_of(place) + faces_.node_count(place));
  return cell;
}

}  // namespace meshsmooth::formats
