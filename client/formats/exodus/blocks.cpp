#include "exodus/blocks.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <span>
#include <utility>

#include "cell_list.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

std::string numbered(const std::string& name, std::size_t number) {
  return name + std::to_string(number);
}

/// In any case; `name` in small letters.
bool begins_with(std::string_view type, std::string_view name) {
  return std::ranges::equal(type.substr(0, name.size()), name, {},
                            [](unsigned char c) { return std::tolower(c); });
}

/// Lists that stand one after the other, by the lengths that another variable has.
FoamFaces split(const NetcdfFile& file, const std::string& variable, const std::string& lengths) {
  FoamFaces lists;
  lists.nodes = file.integers(variable);
  const auto all = static_cast<std::int64_t>(lists.nodes.size());
  for (const std::int64_t length : file.integers(lengths)) {
    if (length < 0 || length > all - lists.first.back()) {
      file.fail("\"" + lengths + "\" has more numbers than \"" + variable + "\"");
    }
    lists.first.push_back(lists.first.back() + length);
  }
  if (lists.first.back() != all) {
    file.fail("\"" + variable + "\" has " + std::to_string(all) + " numbers, by \"" + lengths +
              "\" it has " + std::to_string(lists.first.back()));
  }
  return lists;
}

/// Rows of one length.
FoamFaces rows(const NetcdfFile& file, const std::string& variable) {
  const std::vector<std::size_t> shape = file.shape(variable);
  if (shape.size() != 2) {
    file.fail("\"" + variable + "\" is not an array of elements and their nodes");
  }
  FoamFaces lists;
  lists.nodes = file.integers(variable);
  if (shape[1] == 0) return lists;
  for (std::size_t row = 1; row <= shape[0]; ++row) {
    lists.first.push_back(static_cast<std::int64_t>(row * shape[1]));
  }
  return lists;
}

/// The faces of all blocks of faces, which count through them.
FoamFaces read_faces(const NetcdfFile& file) {
  FoamFaces faces;
  for (const std::size_t number : file.numbers_behind("fbconn")) {
    const std::string variable = numbered("fbconn", number);
    const std::string lengths = numbered("fbepecnt", number);
    const FoamFaces more =
        file.has(lengths) ? split(file, variable, lengths) : rows(file, variable);
    const std::int64_t offset = faces.first.back();
    for (std::size_t row = 1; row < more.first.size(); ++row) {
      faces.first.push_back(more.first[row] + offset);
    }
    faces.nodes.insert(faces.nodes.end(), more.nodes.begin(), more.nodes.end());
  }
  return faces;
}

/// Polyhedra by their faces.
void read_polyhedra(const NetcdfFile& file, std::size_t number, const FoamFaces& faces,
                    ExodusBlock& block) {
  const std::string variable = numbered("facconn", number);
  block.faces = split(file, variable, numbered("ebepecnt", number));
  for (std::int64_t& face : block.faces.nodes) {
    if (face < 1 || face > static_cast<std::int64_t>(faces.size())) {
      file.fail("\"" + variable + "\" has face " + std::to_string(face) + ", there are only " +
                std::to_string(faces.size()));
    }
    --face;
  }
  for (std::size_t element = 0; element < block.faces.size(); ++element) {
    std::set<std::int64_t> nodes;
    for (std::size_t index = 0; index < block.faces.node_count(element); ++index) {
      const auto face = static_cast<std::size_t>(block.faces.nodes_of(element)[index]);
      nodes.insert(faces.nodes_of(face), faces.nodes_of(face) + faces.node_count(face));
    }
    block.elements.nodes.insert(block.elements.nodes.end(), nodes.begin(), nodes.end());
    block.elements.first.push_back(static_cast<std::int64_t>(block.elements.nodes.size()));
  }
}

class BlockReader {
 public:
  BlockReader(const NetcdfFile& file, const std::filesystem::path& path, std::size_t dimension)
      : file_(file),
        path_(path),
        dimension_(dimension),
        ids_(file, "eb_prop1"),
        names_(file.rows("eb_names")) {
    if (file.has("eb_status")) status_ = file.integers("eb_status");
  }

  ExodusMesh read() {
    ExodusMesh mesh;
    std::set<std::size_t> numbers;
    for (const char* name : {"connect", "facconn"}) {
      for (const std::size_t number : file_.numbers_behind(name)) numbers.insert(number);
    }
    for (const std::size_t number : file_.dimension_numbers("num_el_in_blk")) {
      numbers.insert(number);
    }
    const std::size_t count = file_.dimension("num_el_blk").value_or(0);
    if (!file_.numbers_behind("facconn").empty()) mesh.faces = read_faces(file_);
    std::size_t elements = 0;
    for (const std::size_t number : numbers) {
      if (number > count) {
        file_.fail("there is a block number " + std::to_string(number) +
                   ", by \"num_el_blk\" there are only " + std::to_string(count));
      }
      ExodusBlock block = read_block(number, mesh.faces);
      elements += block.elements.size();
      if (block.elements.size() != 0) mesh.blocks.push_back(std::move(block));
    }
    const auto expected = file_.dimension("num_elem");
    if (expected && *expected != elements) {
      file_.fail("its blocks have " + std::to_string(elements) + " elements, by \"num_elem\" " +
                 std::to_string(*expected));
    }
    return mesh;
  }

 private:
  ExodusBlock read_block(std::size_t number, const FoamFaces& faces) const {
    ExodusBlock block{ids_[number - 1],
                      exodus_name(names_, number - 1, "block", ids_[number - 1]),
                      {},
                      {},
                      {},
                      {}};
    const std::string connect = numbered("connect", number);
    const std::string polyhedra = numbered("facconn", number);
    const auto count = file_.dimension(numbered("num_el_in_blk", number));
    const bool has_nodes = file_.has(connect);
    if (!has_nodes && !file_.has(polyhedra)) {
      const bool empty = number <= status_.size() && status_[number - 1] == 0;
      if (count.value_or(0) == 0 || empty) return block;
      file_.fail("block " + std::to_string(block.id) + " has " + std::to_string(*count) +
                 " elements but no variable \"" + connect + "\"");
    }
    const std::string& variable = has_nodes ? connect : polyhedra;
    block.type = file_.text_attribute(variable, "elem_type");
    if (!has_nodes || begins_with(block.type, "nfa")) {
      read_polyhedra(file_, number, faces, block);
    } else if (is_exodus_polygon(block)) {
      block.elements = split(file_, variable, numbered("ebepecnt", number));
    } else {
      read_shaped(variable, block);
    }
    if (count && *count != block.elements.size()) {
      file_.fail("\"" + variable + "\" has " + std::to_string(block.elements.size()) +
                 " elements, block " + std::to_string(block.id) + " has " + std::to_string(*count));
    }
    return block;
  }

  void read_shaped(const std::string& variable, ExodusBlock& block) const {
    block.elements = rows(file_, variable);
    if (block.elements.size() == 0) return;
    const std::size_t corners = block.elements.node_count(0);
    block.shape = find_exodus_shape(block.type, corners, dimension_);
    if (block.shape || (!block.type.empty() && !is_exodus_type(block.type))) return;
    fail("ELEMENT_NOT_SUPPORTED", path_,
         "block " + std::to_string(block.id) + " has elements of the type \"" + block.type +
             "\" with " + std::to_string(corners) + " nodes; " + kSupportedElements);
  }

  const NetcdfFile& file_;
  const std::filesystem::path& path_;
  std::size_t dimension_;
  ExodusIds ids_;
  std::vector<std::string> names_;
  std::vector<std::int64_t> status_;
};

/// Of a cell whose block has no shape.
int cell_type(const ExodusBlock& block, PlainDataset& dataset) {
  if (block.faces.size() != 0) return kPolyhedronCell;
  if (is_exodus_polygon(block)) return kPolygonCell;
  return dataset.own_type(block.type);
}

int dimension_of(const ExodusBlock& block) {
  if (block.shape) return block.shape->kind->dimension;
  return block.faces.size() != 0 ? 3 : 2;
}

}  // namespace

bool is_exodus_polygon(const ExodusBlock& block) { return begins_with(block.type, "nsi"); }

std::string exodus_name(const std::vector<std::string>& names, std::size_t index,
                        const std::string& kind, std::int64_t id) {
  if (index < names.size() && !names[index].empty()) return names[index];
  return kind + "_" + std::to_string(id);
}

ExodusMesh read_exodus_blocks(const NetcdfFile& file, const std::filesystem::path& path,
                              std::size_t dimension) {
  return BlockReader(file, path, dimension).read();
}

void add_exodus_cells(const ExodusMesh& mesh, FileContent& content, PlainDataset& dataset) {
  CellList cells;
  Column column{kBlockArray, true, {}};
  for (const ExodusBlock& block : mesh.blocks) {
    const int other_type = block.shape ? 0 : cell_type(block, dataset);
    for (std::size_t row = 0; row < block.elements.size(); ++row) {
      const std::span nodes(block.elements.nodes_of(row), block.elements.node_count(row));
      const CellKind* polygon =
          other_type == kPolygonCell ? find_vtk_cell(kPolygonCell, nodes.size()) : nullptr;
      if (block.shape) {
        cells.add(*block.shape->kind, NodeOrder::exodus, nodes, 1);
      } else if (polygon != nullptr) {
        cells.add(*polygon, NodeOrder::exodus, nodes, 1);
      } else {
        cells.add(other_type, nodes, 1);
      }
      column.values.push_back(static_cast<double>(block.id));
    }
    content.groups.push_back(
        {dimension_of(block), block.name, kBlockArray, {static_cast<int>(block.id)}});
  }
  cells.store(dataset);
  dataset.add_cell_column(std::move(column));
}

}  // namespace meshsmooth::formats
