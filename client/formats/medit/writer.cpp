#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "cells.hpp"
#include "medit/model.hpp"
#include "node_orders.hpp"
#include "plane.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats::medit {
namespace {

using std::filesystem::path;

/// The rows of a section, references with them.
struct Rows {
  std::string_view name;
  int code;
  std::size_t width;
  std::vector<std::int64_t> numbers;

  [[nodiscard]] std::size_t count() const { return numbers.size() / width; }
};

/// What is written, in the order of the sections.
struct Contents {
  int dimension = 3;
  std::vector<std::int64_t> vertex_references;
  std::vector<Rows> sections;
};

/// Of the cells: the first column that tells them apart.
std::optional<Column> find_references(const Dataset& dataset) {
  for (const char* name : {kPhysicalArray, kReferenceArray, kEntityArray}) {
    auto column = dataset.cell_column(name);
    if (column && std::ranges::any_of(column->values, [](double value) { return value != 0; })) {
      return column;
    }
  }
  return std::nullopt;
}

std::int64_t to_reference(const std::optional<Column>& column, std::size_t index) {
  if (!column) return 0;
  const double value = column->values[index];
  return value > -2e9 && value < 2e9 ? static_cast<std::int64_t>(value) : 0;
}

/// Files in two dimensions, of this format or SU2, stay so.
bool is_plane_source(const MeshFile& file) {
  if (!file.content() || file.content()->segments.empty()) return false;
  const TextSegment& segment = file.content()->segments.front();
  return !segment.fields.fields.empty() && segment.fields.fields.front()[2].length == 0 &&
         file.content()->extension != ".inp";
}

void add_cells(const path& file_name, const Dataset& dataset, Contents& contents) {
  const std::optional<Column> references = find_references(dataset);
  std::map<int, std::size_t> places;  // of the sections, by code
  Cell cell;
  for (std::int64_t id = 0; id < dataset.cell_count(); ++id) {
    dataset.get_cell(id, cell);
    const std::int64_t reference = to_reference(references, static_cast<std::size_t>(id));
    if (cell.type == kVertexCell) {  // its vertex takes the reference
      contents.vertex_references[static_cast<std::size_t>(cell.nodes.front())] = reference;
      continue;
    }
    const CellKind* kind = find_vtk_cell(cell.type, cell.nodes.size());
    const Keyword* keyword = kind == nullptr ? nullptr : find_section(kind->vtk_type);
    if (keyword == nullptr) {
      fail("ELEMENT_NOT_SUPPORTED", file_name,
           extension_of(file_name) + " files cannot carry a " +
               (kind == nullptr ? dataset.cell_name(cell.type) : std::string(kind->name)));
    }
    const auto [place, added] = places.emplace(keyword->code, contents.sections.size());
    if (added) {
      contents.sections.push_back({keyword->name, keyword->code, cell.nodes.size() + 1, {}});
    }
    auto& numbers = contents.sections[place->second].numbers;
    const std::size_t first = numbers.size();
    numbers.resize(first + cell.nodes.size(), 0);
    const bool usual = kind->vtk_type == kTetrahedron10Cell;  // the nodes on edges as in VTK
    std::size_t node = 0;
    for (const std::int8_t in : places_in(usual ? NodeOrder::vtk : NodeOrder::gmsh, *kind)) {
      numbers[first + static_cast<std::size_t>(in)] = cell.nodes[node++] + 1;
    }
    numbers.push_back(reference);
  }
}

/// Between text and binary, what must stay goes with the mesh.
void add_kept(const MeshFile& file, Contents& contents) {
  if (!file.content()) return;
  const auto add = [&](std::string_view name, int code, std::vector<NodeId> nodes) {
    std::ranges::sort(nodes);
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    Rows rows{name, code, 1, {}};
    for (const NodeId node : nodes) rows.numbers.push_back(std::int64_t{node} + 1);
    if (!nodes.empty()) contents.sections.push_back(std::move(rows));
  };
  const auto& sets = file.content()->node_sets;
  const auto corners = std::ranges::find(sets, "Corners", &NodeSet::name);
  if (corners != sets.end()) add("Corners", kCornersCode, corners->nodes);
  add("RequiredVertices", kRequiredVerticesCode, file.content()->fixed_nodes);
}

Contents collect(const path& file_name, const MeshFile& file) {
  const std::shared_ptr<const Dataset> dataset = dataset_of(file);
  Contents contents;
  if (is_plane_source(file)) {
    contents.dimension = 2;
    check_plane(file_name, file.mesh);
  }
  const std::optional<Column> references = dataset->node_column(kReferenceArray);
  for (std::size_t node = 0; node < file.mesh.node_count(); ++node) {
    contents.vertex_references.push_back(to_reference(references, node));
  }
  add_cells(file_name, *dataset, contents);
  add_kept(file, contents);
  return contents;
}

bool is_single(const Mesh& mesh) {
  return std::holds_alternative<std::vector<Vec3f>>(mesh.positions);
}

template <class Number>
void append_word(std::string& text, Number number, char end) {
  std::array<char, 32> digits{};
  const auto [last, error] = std::to_chars(digits.data(), digits.data() + digits.size(), number);
  text.append(digits.data(), last) += end;
}

/// Little-endian, as 4 or 8 bytes.
void append_bytes(std::string& bytes, std::uint64_t value, std::size_t size) {
  for (std::size_t byte = 0; byte < size; ++byte) {
    bytes += static_cast<char>(value >> (8 * byte) & 0xFF);
  }
}

void append_bytes(std::string& bytes, float number) {
  append_bytes(bytes, std::bit_cast<std::uint32_t>(number), 4);
}
void append_bytes(std::string& bytes, double number) {
  append_bytes(bytes, std::bit_cast<std::uint64_t>(number), 8);
}

/// Sections of a binary file whose integers have four bytes and whose positions have eight where it
/// is large.
class BinaryWriter {
 public:
  explicit BinaryWriter(int version) : position_bytes_(version >= 3 ? 8 : 4) {
    append_bytes(bytes_, 1, 4);
    integer(version);
  }

  void integer(std::int64_t value) { append_bytes(bytes_, static_cast<std::uint64_t>(value), 4); }
  template <class Real>
  void real(Real value) {
    append_bytes(bytes_, value);
  }
  /// `size`: bytes of the section after its head.
  void open(int code, std::size_t size) {
    integer(code);
    append_bytes(bytes_, code == kEndCode ? 0 : bytes_.size() + position_bytes_ + size,
                 position_bytes_);
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::size_t position_bytes_;
  std::string bytes_;
};

}  // namespace

std::string make_text(const path& file_name, const MeshFile& file) {
  const Contents contents = collect(file_name, file);
  std::string text = std::string("MeshVersionFormatted ") + (is_single(file.mesh) ? "1" : "2") +
                     "\nDimension " + std::to_string(contents.dimension) + "\nVertices\n" +
                     std::to_string(file.mesh.node_count()) + '\n';
  const auto append_vertices = [&](const auto& positions) {
    for (std::size_t node = 0; node < positions.size(); ++node) {
      append_word(text, positions[node].x, ' ');
      append_word(text, positions[node].y, ' ');
      if (contents.dimension == 3) append_word(text, positions[node].z, ' ');
      append_word(text, contents.vertex_references[node], '\n');
    }
  };
  std::visit(append_vertices, file.mesh.positions);
  for (const Rows& rows : contents.sections) {
    text += std::string(rows.name) + '\n' + std::to_string(rows.count()) + '\n';
    for (std::size_t at = 0; at < rows.numbers.size(); ++at) {
      append_word(text, rows.numbers[at], (at + 1) % rows.width == 0 ? '\n' : ' ');
    }
  }
  return text + "End\n";
}

std::string make_binary(const path& file_name, const MeshFile& file) {
  const Contents contents = collect(file_name, file);
  const bool single = is_single(file.mesh);
  const auto axes = static_cast<std::size_t>(contents.dimension);
  const std::size_t vertices_size = 4 + file.mesh.node_count() * (axes * (single ? 4 : 8) + 4);
  std::size_t size = vertices_size;
  for (const Rows& rows : contents.sections) size += 4 * rows.numbers.size() + 16;
  constexpr std::size_t kSmall = 2'000'000'000;  // bytes that positions of four bytes reach
  const bool large = size > kSmall;
  BinaryWriter writer(large ? 3 : single ? 1 : 2);
  writer.open(kDimensionCode, 4);
  writer.integer(contents.dimension);
  if (large && single) {
    writer.open(kPrecisionCode, 4);
    writer.integer(32);
  }
  writer.open(kVerticesCode, vertices_size);
  writer.integer(static_cast<std::int64_t>(file.mesh.node_count()));
  const auto append_vertices = [&](const auto& positions) {
    for (std::size_t node = 0; node < positions.size(); ++node) {
      writer.real(positions[node].x);
      writer.real(positions[node].y);
      if (axes == 3) writer.real(positions[node].z);
      writer.integer(contents.vertex_references[node]);
    }
  };
  std::visit(append_vertices, file.mesh.positions);
  for (const Rows& rows : contents.sections) {
    writer.open(rows.code, 4 + 4 * rows.numbers.size());
    writer.integer(static_cast<std::int64_t>(rows.count()));
    for (const std::int64_t number : rows.numbers) writer.integer(number);
  }
  writer.open(kEndCode, 0);
  return writer.take();
}

}  // namespace meshsmooth::formats::medit
