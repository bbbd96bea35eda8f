#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "cell_list.hpp"
#include "content.hpp"
#include "hdf5_file.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

// The library of MED stands on the HDF5 for MPI, whose file format this is: groups by fixed names,
// and all arrays axis by axis, or corner by corner.

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

/// The groups of each family, by its number.
using Families = std::map<std::int64_t, std::vector<std::string>>;

std::string list_of(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

/// The one child that is a group, for one mesh of one time step can be smoothed.
std::string only_child(const Hdf5File& file, const std::string& parent, const std::string& what) {
  const std::vector<std::string> names =
      file.has(parent) ? file.children(parent) : std::vector<std::string>();
  if (names.empty()) file.fail("there is no " + what + " in it: \"" + parent + "\" is empty");
  if (names.size() > 1) {
    file.fail("only a file with one " + what + " can be smoothed; this one has " +
              std::to_string(names.size()) + ": " + list_of(names));
  }
  return names.front();
}

Families read_families(const Hdf5File& file, const std::string& parent) {
  constexpr std::size_t kNameLength = 80;
  Families families;
  if (!file.has(parent)) return families;
  for (const std::string& family : file.children(parent)) {
    const std::string folder = parent + "/" + family;
    const auto number = file.integer_attribute(folder, "NUM");
    if (!number || !file.has(folder + "/GRO/NOM")) continue;
    const std::string names = file.text(folder + "/GRO/NOM");
    for (std::size_t first = 0; first < names.size(); first += kNameLength) {
      std::string name = names.substr(first, kNameLength).c_str();  // up to its NUL
      name.erase(name.find_last_not_of(' ') + 1);
      if (!name.empty()) families[*number].push_back(name);
    }
  }
  return families;
}

/// One number each, or none: 0.
std::vector<std::int64_t> read_family_numbers(const Hdf5File& file, const std::string& folder,
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

/// From 1, as MED counts, unless the file has numbers of its own and no two are the same.
std::vector<std::int64_t> ids_of(std::vector<std::int64_t> numbers, std::size_t count) {
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

void read_nodes(const Hdf5File& file, const path& path, const std::string& step,
                FileContent& content, PlainDataset& dataset) {
  const std::string folder = step + "/NOE";
  const std::string name = folder + "/COO";
  const std::vector<double> numbers = file.reals(name);
  const std::int64_t count = file.integer_attribute(name, "NBR").value_or(0);
  if (count < 1 || numbers.size() % static_cast<std::size_t>(count) != 0) {
    file.fail("\"" + name + "\" has " + std::to_string(numbers.size()) + " numbers for " +
              std::to_string(count) + " nodes");
  }
  content.arrays.names = {name};
  content.arrays.dimension = numbers.size() / static_cast<std::size_t>(count);
  content.arrays.single_precision = file.is_single_precision(name);
  dataset.set_positions(positions_of(path, content.arrays, {numbers}));
  const auto node_count = static_cast<std::size_t>(count);
  content.node_ids = ids_of(
      file.has(folder + "/NUM") ? file.integers(folder + "/NUM") : std::vector<std::int64_t>(),
      node_count);
}

void add_node_groups(const Hdf5File& file, const std::string& step, const Families& families,
                     std::size_t node_count, FileContent& content) {
  const auto numbers = read_family_numbers(file, step + "/NOE", node_count);
  std::map<std::string, std::vector<NodeId>> groups;
  for (const auto& [number, names] : families) {
    for (const std::string& name : names) groups[name];
  }
  for (std::size_t node = 0; node < node_count; ++node) {
    const auto family = families.find(numbers[node]);
    if (family == families.end()) continue;
    for (const std::string& name : family->second) {
      groups[name].push_back(static_cast<NodeId>(node));
    }
  }
  for (auto& [name, nodes] : groups) content.node_sets.push_back({name, std::move(nodes)});
}

const CellKind& kind_of(const path& path, const std::string& folder, const std::string& type) {
  const auto* known = std::ranges::find(kTypes, type, &std::pair<std::string_view, int>::first);
  if (known == kTypes.end()) {
    fail("ELEMENT_NOT_SUPPORTED", path,
         "\"" + folder + "\" has elements of the type " + type + "; " + kSupportedElements);
  }
  return *find_vtk_cell(known->second);
}

class CellReader {
 public:
  CellReader(const Hdf5File& file, const path& path, FileContent& content)
      : file_(file), path_(path), content_(content) {}

  void read(const std::string& step, const Families& families) {
    if (!file_.has(step + "/MAI")) return;
    for (const std::string& type : file_.children(step + "/MAI")) {
      read_type(step + "/MAI/" + type, kind_of(path_, step + "/MAI", type), families);
    }
    for (auto& [key, values] : groups_) {
      content_.groups.push_back(
          {key.second, key.first, kFamilyArray, {values.begin(), values.end()}});
    }
    content_.cell_ids = ids_of(std::move(ids_), cells_.size());
  }
  void store(PlainDataset& dataset) {
    cells_.store(dataset);
    dataset.add_cell_column(std::move(column_));
  }

 private:
  void read_type(const std::string& folder, const CellKind& kind, const Families& families) {
    const std::vector<std::int64_t> nodes = file_.integers(folder + "/NOD");
    const auto corners = static_cast<std::size_t>(kind.node_count);
    const std::size_t count = nodes.size() / corners;
    if (nodes.size() != count * corners) {
      file_.fail("\"" + folder + "/NOD\" has " + std::to_string(nodes.size()) +
                 " numbers, which is no multiple of " + std::to_string(corners));
    }
    std::vector<std::int64_t> cell(corners);
    for (std::size_t row = 0; row < count; ++row) {
      for (std::size_t corner = 0; corner < corners; ++corner) {
        cell[corner] = nodes[corner * count + row];
      }
      cells_.add(kind, NodeOrder::med, cell, 1);
    }
    for (const std::int64_t family : read_family_numbers(file_, folder, count)) {
      column_.values.push_back(static_cast<double>(family));
      const auto found = families.find(family);
      if (found == families.end()) continue;
      for (const std::string& name : found->second) {
        groups_[{name, kind.dimension}].insert(static_cast<int>(family));
      }
    }
    if (!file_.has(folder + "/NUM")) return;
    const std::vector<std::int64_t> ids = file_.integers(folder + "/NUM");
    ids_.insert(ids_.end(), ids.begin(), ids.end());
  }

  const Hdf5File& file_;
  const path& path_;
  FileContent& content_;
  CellList cells_;
  Column column_ = {kFamilyArray, true, {}};
  std::vector<std::int64_t> ids_;
  std::map<std::pair<std::string, int>, std::set<int>> groups_;  // families by name, dimension
};

}  // namespace

MeshFile read_med(const path& path) {
  FileContent content;
  content.extension = ".med";
  content.text = read_bytes(path);
  const Hdf5File file(path, content.text);
  const std::string mesh = only_child(file, "/ENS_MAA", "mesh");
  const std::string folder = "/ENS_MAA/" + mesh;
  if (file.integer_attribute(folder, "TYP").value_or(0) != 0) {
    fail("ELEMENT_NOT_SUPPORTED", path, "the mesh \"" + mesh + "\" is structured");
  }
  if (file.has(folder + "/NOE")) {
    file.fail("it is of version 2 of the MED format; medimport converts it");
  }
  const std::string step = folder + "/" + only_child(file, folder, "time step");

  const auto dataset = std::make_shared<PlainDataset>();
  read_nodes(file, path, step, content, *dataset);
  add_node_groups(file, step, read_families(file, "/FAS/" + mesh + "/NOEUD"),
                  static_cast<std::size_t>(dataset->node_count()), content);
  CellReader cells(file, path, content);
  cells.read(step, read_families(file, "/FAS/" + mesh + "/ELEME"));
  cells.store(*dataset);
  content.dataset = dataset;
  return make_mesh_file(path, std::move(content));
}

}  // namespace meshsmooth::formats
