#include "med/cells.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "text.hpp"

namespace meshsmooth::formats {
namespace {

constexpr auto kTypes = std::to_array<std::pair<std::string_view, int>>({
    {"PO1", kVertexCell},
    {"SE2", kLineCell},
    {"SE3", kEdge3Cell},
    {"TR3", kTriangleCell},
    {"TR6", kTriangle6Cell},
    {"QU4", kQuadCell},
    {"QU8", kQuad8Cell},
    {"QU9", kQuad9Cell},
    {"TE4", kTetrahedronCell},
    {"T10", kTetrahedron10Cell},
    {"PY5", kPyramidCell},
    {"P13", kPyramid13Cell},
    {"PE6", kWedgeCell},
    {"P15", kWedge15Cell},
    {"P18", kWedge18Cell},
    {"HE8", kHexahedronCell},
    {"H20", kHexahedron20Cell},
    {"H27", kHexahedron27Cell},
});

constexpr const char* kPolygons = "POG";
constexpr const char* kPolygonsOfSecondOrder = "PO2";
constexpr const char* kPolyhedra = "POE";
constexpr const char* kHexagonalPrisms = "O12";

}  // namespace

std::vector<std::int64_t> read_med_family_numbers(const Hdf5File& file, const std::string& folder,
                                                  std::size_t count) {
  const std::string name = folder + "/FAM";
  if (!file.has(name)) return std::vector<std::int64_t>(count, 0);
  std::vector<std::int64_t> numbers = file.integers(name);
  if (numbers.size() != count) {
    file.fail("\"" + name + "\" has " + std::to_string(numbers.size()) + " numbers instead of " +
              std::to_string(count));
  }
  return numbers;
}

std::vector<std::int64_t> med_ids(std::vector<std::int64_t> numbers, std::size_t count) {
  if (numbers.size() == count &&
      std::set<std::int64_t>(numbers.begin(), numbers.end()).size() == count) {
    return numbers;
  }
  numbers.resize(count);
  for (std::size_t place = 0; place < count; ++place) {
    numbers[place] = static_cast<std::int64_t>(place) + 1;
  }
  return numbers;
}

void MedCells::read(const std::string& step, const MedFamilies& families, PlainDataset& dataset) {
  if (!file_.has(step + "/MAI")) return;
  for (const std::string& type : file_.children(step + "/MAI")) {
    const std::string folder = step + "/MAI/" + type;
    const std::size_t before = cells_.size();
    int dimension = 2;
    if (!file_.has(folder + "/NOD")) {
      fail("ELEMENT_NOT_SUPPORTED", path_,
           "\"" + folder + "\" has no nodes of its elements (NOD)" +
               (file_.has(folder + "/DES") ? ", but their faces (descending connectivity)" : ""));
    }
    const auto* known = std::ranges::find(kTypes, type, &std::pair<std::string_view, int>::first);
    if (known != kTypes.end()) {
      const CellKind& kind = *find_vtk_cell(known->second);
      dimension = kind.dimension;
      read_type(folder, kind);
    } else if (type == kPolygons) {
      read_polygons(folder, kPolygonCell);
    } else if (type == kPolygonsOfSecondOrder) {
      read_polygons(folder, dataset.own_type("polygon of second order"));
    } else if (type == kPolyhedra) {
      dimension = 3;
      read_polyhedra(folder);
    } else if (type == kHexagonalPrisms) {
      constexpr std::size_t kCorners = 12;
      dimension = 3;
      read_held(folder, kPolyhedronCell, kCorners);
    } else {
      fail("ELEMENT_NOT_SUPPORTED", path_,
           "\"" + step + "/MAI\" has elements of the type " + type + "; " + kSupportedElements);
    }
    read_families(folder, dimension, cells_.size() - before, families);
  }
  for (auto& [key, values] : groups_) {
    content_.groups.push_back(
        {key.second, key.first, kFamilyArray, {values.begin(), values.end()}});
  }
  content_.cell_ids = med_ids(std::move(ids_), cells_.size());
}

void MedCells::store(PlainDataset& dataset) {
  cells_.store(dataset);
  dataset.add_cell_column(std::move(column_));
}

/// The nodes of elements, first of all their first corners; as many as the file says.
std::vector<std::int64_t> MedCells::axis_by_axis(const std::string& folder,
                                                 std::size_t corners) const {
  std::vector<std::int64_t> nodes = file_.integers(folder + "/NOD");
  const std::size_t count = nodes.size() / corners;
  if (nodes.size() != count * corners) {
    file_.fail("\"" + folder + "/NOD\" has " + std::to_string(nodes.size()) +
               " numbers, which is no multiple of " + std::to_string(corners));
  }
  const auto said = file_.integer_attribute(folder + "/NOD", "NBR");
  if (said && *said != static_cast<std::int64_t>(count)) {
    file_.fail("\"" + folder + "/NOD\" has " + std::to_string(count) +
               " elements, by its attribute NBR " + std::to_string(*said));
  }
  return nodes;
}

void MedCells::read_type(const std::string& folder, const CellKind& kind) {
  const auto corners = static_cast<std::size_t>(kind.node_count);
  const std::vector<std::int64_t> nodes = axis_by_axis(folder, corners);
  const std::size_t count = nodes.size() / corners;
  std::vector<std::int64_t> cell(corners);
  for (std::size_t row = 0; row < count; ++row) {
    for (std::size_t corner = 0; corner < corners; ++corner) {
      cell[corner] = nodes[corner * count + row];
    }
    cells_.add(kind, NodeOrder::med, cell, 1);
  }
}

void MedCells::read_held(const std::string& folder, int type, std::size_t corners) {
  const std::vector<std::int64_t> nodes = axis_by_axis(folder, corners);
  const std::size_t count = nodes.size() / corners;
  std::vector<std::int64_t> cell(corners);
  for (std::size_t row = 0; row < count; ++row) {
    for (std::size_t corner = 0; corner < corners; ++corner) {
      cell[corner] = nodes[corner * count + row];
    }
    cells_.add(type, cell, 1);
  }
}

/// Where lists of `all` numbers begin, from 0, and the end; the file counts from 1.
std::vector<std::int64_t> MedCells::index(const std::string& name, std::size_t all) const {
  std::vector<std::int64_t> first = file_.integers(name);
  for (std::int64_t& place : first) place -= place > 0 ? 1 : 0;
  if (first.empty() || first.front() != 0 || !std::ranges::is_sorted(first) ||
      first.back() != static_cast<std::int64_t>(all)) {
    file_.fail("the index \"" + name + "\" does not fit its " + std::to_string(all) + " numbers");
  }
  return first;
}

void MedCells::read_polygons(const std::string& folder, int type) {
  const std::vector<std::int64_t> nodes = file_.integers(folder + "/NOD");
  const std::vector<std::int64_t> first = index(folder + "/INN", nodes.size());
  for (std::size_t row = 0; row + 1 < first.size(); ++row) {
    const auto of = std::span(nodes).subspan(static_cast<std::size_t>(first[row]),
                                             static_cast<std::size_t>(first[row + 1] - first[row]));
    const CellKind* kind = type == kPolygonCell ? find_vtk_cell(kPolygonCell, of.size()) : nullptr;
    if (kind != nullptr) {
      cells_.add(*kind, NodeOrder::med, of, 1);
    } else {
      cells_.add(type, of, 1);
    }
  }
}

void MedCells::read_polyhedra(const std::string& folder) {
  const std::vector<std::int64_t> nodes = file_.integers(folder + "/NOD");
  const std::vector<std::int64_t> of_face = index(folder + "/INN", nodes.size());
  const std::vector<std::int64_t> of_cell = index(folder + "/IFN", of_face.size() - 1);
  for (std::size_t row = 0; row + 1 < of_cell.size(); ++row) {
    const std::int64_t begin = of_face[static_cast<std::size_t>(of_cell[row])];
    const std::int64_t end = of_face[static_cast<std::size_t>(of_cell[row + 1])];
    const std::set<std::int64_t> once(nodes.begin() + begin, nodes.begin() + end);
    cells_.add(kPolyhedronCell, std::vector<std::int64_t>(once.begin(), once.end()), 1);
  }
}

void MedCells::read_families(const std::string& folder, int dimension, std::size_t count,
                             const MedFamilies& families) {
  for (const std::int64_t family : read_med_family_numbers(file_, folder, count)) {
    column_.values.push_back(static_cast<double>(family));
    const auto found = families.find(family);
    if (found == families.end()) continue;
    for (const std::string& name : found->second) {
      groups_[{name, dimension}].insert(static_cast<int>(family));
    }
  }
  if (!file_.has(folder + "/NUM")) return;
  const std::vector<std::int64_t> ids = file_.integers(folder + "/NUM");
  ids_.insert(ids_.end(), ids.begin(), ids.end());
}

}  // namespace meshsmooth::formats
