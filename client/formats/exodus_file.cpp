#include <algorithm>
#include <set>

#include "cell_list.hpp"
#include "classic_header.hpp"
#include "content.hpp"
#include "exodus_sides.hpp"
#include "hdf5_file.hpp"
#include "netcdf_file.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

struct Block {
  std::int64_t id;
  std::string name;
  ExodusShape shape;
  std::vector<std::int64_t> nodes;  // from 1, in Exodus' order
};

std::string numbered(const std::string& name, std::size_t number) {
  return name + std::to_string(number);
}

/// The ids of blocks or sets, which count from 1 where the file has none.
class Ids {
 public:
  Ids(const NetcdfFile& file, const std::string& variable) {
    if (file.has(variable)) ids_ = file.integers(variable);
  }
  [[nodiscard]] std::int64_t operator[](std::size_t index) const {
    return index < ids_.size() ? ids_[index] : static_cast<std::int64_t>(index) + 1;
  }

 private:
  std::vector<std::int64_t> ids_;
};

/// What `--fixed-set` calls the block or set: its name, or "nodeset_3" by its id.
std::string name_of(const std::vector<std::string>& names, std::size_t index,
                    const std::string& kind, std::int64_t id) {
  if (index < names.size() && !names[index].empty()) return names[index];
  return kind + "_" + std::to_string(id);
}

/// The file's own numbers, unless two are the same; then they count from 1.
std::vector<std::int64_t> read_map(const NetcdfFile& file, const std::string& variable,
                                   std::size_t count) {
  std::vector<std::int64_t> ids;
  if (file.has(variable)) ids = file.integers(variable);
  if (ids.size() == count && std::set<std::int64_t>(ids.begin(), ids.end()).size() == count) {
    return ids;
  }
  ids.resize(count);
  for (std::size_t place = 0; place < count; ++place) {
    ids[place] = static_cast<std::int64_t>(place) + 1;
  }
  return ids;
}

/// The indices, from 0, of the blocks or sets that have a variable of theirs, as those without
/// elements have none: of as many as the dimension says.
std::vector<std::size_t> indices_of(const NetcdfFile& file, const std::string& dimension,
                                    const std::string& variable) {
  const std::size_t count = file.dimension(dimension).value_or(0);
  std::vector<std::size_t> indices;
  for (const std::size_t number : file.numbers_behind(variable)) {
    if (number <= count) indices.push_back(number - 1);
  }
  return indices;
}

std::vector<Block> read_blocks(const NetcdfFile& file, const path& path) {
  std::vector<Block> blocks;
  const Ids ids(file, "eb_prop1");
  const std::vector<std::string> names = file.rows("eb_names");
  for (const std::size_t index : indices_of(file, "num_el_blk", "connect")) {
    const std::string variable = numbered("connect", index + 1);
    const std::int64_t id = ids[index];
    const std::size_t corners = file.dimension(numbered("num_nod_per_el", index + 1)).value_or(0);
    const std::string type = file.text_attribute(variable, "elem_type");
    const auto shape = find_exodus_shape(type, corners);
    if (!shape) {
      fail("ELEMENT_NOT_SUPPORTED", path,
           "block " + std::to_string(id) + " has elements of the type \"" + type + "\" with " +
               std::to_string(corners) + " nodes; " + kSupportedElements);
    }
    Block& block = blocks.emplace_back(
        Block{id, name_of(names, index, "block", id), *shape, file.integers(variable)});
    if (block.nodes.size() % corners != 0) {
      file.fail("\"" + variable + "\" has " + std::to_string(block.nodes.size()) +
                " numbers, which is no multiple of " + std::to_string(corners));
    }
  }
  return blocks;
}

void add_cells(const std::vector<Block>& blocks, FileContent& content, PlainDataset& dataset) {
  CellList cells;
  Column column{kBlockArray, true, {}};
  for (const Block& block : blocks) {
    const auto corners = static_cast<std::size_t>(block.shape.kind->node_count);
    const std::span nodes(block.nodes);
    for (std::size_t first = 0; first < nodes.size(); first += corners) {
      cells.add(*block.shape.kind, NodeOrder::exodus, nodes.subspan(first, corners), 1);
      column.values.push_back(static_cast<double>(block.id));
    }
    content.groups.push_back(
        {block.shape.kind->dimension, block.name, kBlockArray, {static_cast<int>(block.id)}});
  }
  cells.store(dataset);
  dataset.add_cell_column(std::move(column));
}

/// The nodes, which the file counts from 1.
NodeSet make_set(const NetcdfFile& file, std::string name, const std::vector<std::int64_t>& nodes,
                 std::int64_t node_count) {
  NodeSet set{std::move(name), {}};
  for (const std::int64_t node : nodes) {
    if (node < 1 || node > node_count) {
      file.fail("the set \"" + set.name + "\" has node " + std::to_string(node) +
                ", there are only " + std::to_string(node_count));
    }
    set.nodes.push_back(static_cast<NodeId>(node - 1));
  }
  return set;
}

void read_node_sets(const NetcdfFile& file, std::int64_t node_count, FileContent& content) {
  const std::vector<std::string> names = file.rows("ns_names");
  const Ids ids(file, "ns_prop1");
  for (const std::size_t index : indices_of(file, "num_node_sets", "node_ns")) {
    const std::string variable = numbered("node_ns", index + 1);
    content.node_sets.push_back(make_set(file, name_of(names, index, "nodeset", ids[index]),
                                         file.integers(variable), node_count));
  }
}

/// The nodes of one side of an element; both count from 1.
void add_side(const NetcdfFile& file, const std::string& variable, const std::vector<Block>& blocks,
              std::int64_t element, std::int64_t side, std::vector<std::int64_t>& nodes) {
  std::int64_t left = element - 1;
  for (const Block& block : blocks) {
    const std::int64_t corners = block.shape.kind->node_count;
    const auto count = static_cast<std::int64_t>(block.nodes.size()) / corners;
    if (left >= 0 && left < count) {
      const auto places = nodes_of_exodus_side(block.shape, side);
      if (places.empty()) break;
      for (const int place : places) {
        nodes.push_back(block.nodes[static_cast<std::size_t>(left * corners + place)]);
      }
      return;
    }
    left -= count;
  }
  file.fail("\"" + variable + "\" has side " + std::to_string(side) + " of element " +
            std::to_string(element) + ", which does not exist");
}

void read_side_sets(const NetcdfFile& file, const std::vector<Block>& blocks,
                    std::int64_t node_count, FileContent& content) {
  const std::vector<std::string> names = file.rows("ss_names");
  const Ids ids(file, "ss_prop1");
  for (const std::size_t index : indices_of(file, "num_side_sets", "elem_ss")) {
    const std::string variable = numbered("elem_ss", index + 1);
    const std::vector<std::int64_t> elements = file.integers(variable);
    const std::vector<std::int64_t> sides = file.integers(numbered("side_ss", index + 1));
    if (sides.size() != elements.size()) {
      file.fail("\"" + variable + "\" has another size than its sides");
    }
    std::vector<std::int64_t> nodes;
    for (std::size_t row = 0; row < sides.size(); ++row) {
      add_side(file, variable, blocks, elements[row], sides[row], nodes);
    }
    content.node_sets.push_back(
        make_set(file, name_of(names, index, "sideset", ids[index]), nodes, node_count));
  }
}

void read_nodes(const NetcdfFile& file, const path& path, FileContent& content,
                PlainDataset& dataset) {
  CoordinateArrays& arrays = content.arrays;
  arrays.dimension = file.dimension("num_dim").value_or(0);
  if (file.has("coord")) {
    arrays.names = {"coord"};
  } else {
    for (const char* name : {"coordx", "coordy", "coordz"}) {
      if (arrays.names.size() < arrays.dimension) arrays.names.emplace_back(name);
    }
  }
  if (arrays.names.empty()) file.fail("there are no coordinates in it: \"num_dim\" is missing");
  std::vector<std::vector<double>> numbers;
  arrays.single_precision = true;
  for (const std::string& name : arrays.names) {
    numbers.push_back(file.reals(name));
    arrays.single_precision = arrays.single_precision && file.is_single_precision(name);
  }
  dataset.set_positions(positions_of(path, arrays, numbers));
  if (static_cast<std::size_t>(dataset.node_count()) != file.dimension("num_nodes")) {
    file.fail("its coordinates are not those of \"num_nodes\" nodes");
  }
  content.node_ids = read_map(file, "node_num_map", static_cast<std::size_t>(dataset.node_count()));
}

}  // namespace

MeshFile read_exodus(const path& path) {
  FileContent content;
  content.extension = ".exo";
  content.text = read_bytes(path);
  if (content.text.starts_with("\x89HDF")) {
    // netCDF lists the variables in a way that crashes HDF5 1.10 where the list is damaged.
    (void)Hdf5File(path, content.text).children("/");
  }
  check_classic_header(path, content.text);
  const NetcdfFile file(path, NetcdfFile::Access::read);
  const auto dataset = std::make_shared<PlainDataset>();
  read_nodes(file, path, content, *dataset);
  const std::vector<Block> blocks = read_blocks(file, path);
  add_cells(blocks, content, *dataset);
  content.cell_ids =
      read_map(file, "elem_num_map", static_cast<std::size_t>(dataset->cell_count()));
  read_node_sets(file, dataset->node_count(), content);
  read_side_sets(file, blocks, dataset->node_count(), content);
  content.dataset = dataset;
  return make_mesh_file(path, std::move(content));
}

void write_exodus(const path& path, const MeshFile& mesh_file) {
  const FileContent& content = *mesh_file.content();
  write_bytes(path, content.text);
  const PositionsView positions = mesh_file.mesh.positions_view();
  if (!has_moved(content.dataset->positions(), positions)) return;
  const auto numbers = numbers_of(path, content.arrays, positions);
  NetcdfFile file(path, NetcdfFile::Access::change);
  for (std::size_t array = 0; array < numbers.size(); ++array) {
    file.overwrite(content.arrays.names[array], numbers[array]);
  }
  file.close();
}

}  // namespace meshsmooth::formats
