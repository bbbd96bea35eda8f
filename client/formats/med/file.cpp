#include <algorithm>
#include <map>
#include <utility>

#include "content.hpp"
#include "hdf5_file.hpp"
#include "med/cells.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

// The library of MED is linked against the HDF5 for MPI; this reads the file format itself: groups
// by fixed names, and all arrays axis by axis, or corner by corner.

std::string list_of(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

std::vector<std::string> children(const Hdf5File& file, const std::string& parent) {
  return file.has(parent) ? file.children(parent) : std::vector<std::string>();
}

/// The one of these names, for one mesh of one time step can be smoothed.
std::string only_name(const Hdf5File& file, const path& path, const std::string& parent,
                      const std::vector<std::string>& names, const std::string& what) {
  if (names.empty()) {
    fail(file.has("/INFOS_GENERALES") ? "MESH_EMPTY" : "FORMAT_ERROR", path,
         "there is no " + what + " in it: \"" + parent + "\" is empty");
  }
  if (names.size() > 1) {
    file.fail("only a file with one " + what + " can be smoothed; this one has " +
              std::to_string(names.size()) + ": " + list_of(names));
  }
  return names.front();
}

/// The one mesh in the file; of several the one with elements.
std::string find_mesh(const Hdf5File& file, const path& path) {
  const std::string parent = "/ENS_MAA";
  std::vector<std::string> names = children(file, parent);
  if (names.size() > 1) {
    std::vector<std::string> with_elements;
    for (const std::string& name : names) {
      const std::string mesh = parent + "/" + name;
      const bool has_elements = std::ranges::any_of(file.children(mesh), [&](const auto& step) {
        const std::string cells = mesh + "/" + step + "/MAI";
        return file.has(cells) && !file.children(cells).empty();
      });
      const bool structured = file.integer_attribute(mesh, "TYP").value_or(0) != 0;
      if (has_elements || structured) with_elements.push_back(name);
    }
    if (with_elements.empty()) {
      fail("MESH_EMPTY", path, "none of its meshes has elements: " + list_of(names));
    }
    if (with_elements.size() == 1) names = std::move(with_elements);
  }
  return only_name(file, path, parent, names, "mesh");
}

MedFamilies read_families(const Hdf5File& file, const std::string& parent) {
  constexpr std::size_t kNameLength = 80;
  MedFamilies families;
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

void read_nodes(const Hdf5File& file, const path& path, const std::string& step,
                FileContent& content, PlainDataset& dataset) {
  const std::string folder = step + "/NOE";
  const std::string name = folder + "/COO";
  if (!file.has(name)) fail("MESH_EMPTY", path, "there are no nodes in it: no \"" + name + "\"");
  const std::vector<double> numbers = file.reals(name);
  const std::int64_t count = file.integer_attribute(name, "NBR").value_or(0);
  if (count < 1 || numbers.size() % static_cast<std::size_t>(count) != 0) {
    file.fail("\"" + name + "\" has " + std::to_string(numbers.size()) + " numbers for " +
              std::to_string(count) + " nodes");
  }
  const auto node_count = static_cast<std::size_t>(count);
  CoordinateArrays arrays;
  arrays.names = {name};
  arrays.dimension = numbers.size() / node_count;
  arrays.node_count = node_count;
  arrays.single_precision = file.is_single_precision(name);
  dataset.set_positions(positions_of(path, arrays, {numbers}));
  content.arrays.push_back(std::move(arrays));
  content.node_ids = med_ids(
      file.has(folder + "/NUM") ? file.integers(folder + "/NUM") : std::vector<std::int64_t>(),
      node_count);
}

void add_node_groups(const Hdf5File& file, const std::string& step, const MedFamilies& families,
                     std::size_t node_count, FileContent& content) {
  const auto numbers = read_med_family_numbers(file, step + "/NOE", node_count);
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

}  // namespace

MeshFile read_med(const path& path) {
  FileContent content;
  content.extension = ".med";
  content.text = read_bytes(path);
  const Hdf5File file(path, content.text);
  const std::string infos = "/INFOS_GENERALES";
  if (file.has(infos) && file.integer_attribute(infos, "MAJ").value_or(3) < 3) {
    file.fail("it is of version 2 of the MED format; medimport converts it");
  }
  const std::string mesh = find_mesh(file, path);
  const std::string folder = "/ENS_MAA/" + mesh;
  if (file.integer_attribute(folder, "TYP").value_or(0) != 0) {
    fail("ELEMENT_NOT_SUPPORTED", path, "the mesh \"" + mesh + "\" is structured");
  }
  if (file.has(folder + "/NOE")) {
    file.fail("it is of version 2 of the MED format; medimport converts it");
  }
  const std::string step =
      folder + "/" + only_name(file, path, folder, children(file, folder), "time step");

  const auto dataset = std::make_shared<PlainDataset>();
  read_nodes(file, path, step, content, *dataset);
  add_node_groups(file, step, read_families(file, "/FAS/" + mesh + "/NOEUD"),
                  static_cast<std::size_t>(dataset->node_count()), content);
  MedCells cells(file, path, content);
  cells.read(step, read_families(file, "/FAS/" + mesh + "/ELEME"), *dataset);
  cells.store(*dataset);
  content.dataset = dataset;
  return make_mesh_file(path, std::move(content));
}

}  // namespace meshsmooth::formats
