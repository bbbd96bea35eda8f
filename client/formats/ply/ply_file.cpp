#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "cells.hpp"
#include "content.hpp"
#include "header.hpp"
#include "notes.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

// VTK's reader crashes on damaged files, and keeps neither float64 nor any
// property that it does not know; its writer knows no float64 either.

/// Reads the rows that the header announces.
class PlyReader {
 public:
  PlyReader(const std::filesystem::path& path, FileContent& content, PlainDataset& dataset)
      : path_(path),
        content_(content),
        dataset_(dataset),
        scanner_(path, content.text),
        header_(read_ply_header(scanner_, notes_)) {
    content_.fields.style = header_.text         ? NumberStyle::shortest
                            : header_.big_endian ? NumberStyle::binary_swapped
                                                 : NumberStyle::binary;
  }

  void read() {
    for (const PlySection& section : header_.sections) {
      if (section.name == "vertex") {
        read_vertices(section);
      } else {
        read_others(section);
      }
    }
    note_rest();
    content_.notes = notes_.texts();
  }

 private:
  struct Value {
    std::string_view word;
    double number;
  };

  Value read_value(PlyType type) {
    if (header_.text) {
      const std::string_view word = scanner_.token();
      return {word, scanner_.parse<double>(word)};
    }
    const std::string_view word = scanner_.bytes(type.bytes);
    return {word, decode_ply(word, type, header_.big_endian)};
  }

  /// A row of a text ends with its line, as other programs have it.
  void finish_row(const PlySection& section, std::size_t row) {
    if (!header_.text || section.properties.empty()) return;
    if (scanner_.token_on_line().empty()) return;
    scanner_.line();
    notes_.add("longer row", [&] {
      return section.name + " " + std::to_string(row) +
             " has more numbers than the header announces, which are ignored";
    });
  }
  void note_rest() {
    const std::string_view all = content_.text;
    const std::size_t rest =
        all.find_first_not_of(std::string_view(" \t\r\n\0", 5), scanner_.position());
    if (rest == std::string_view::npos) return;
    notes_.add("rest", [&] {
      return std::to_string(all.size() - rest) +
             " bytes after the last row that the header announces are ignored";
    });
  }

  std::size_t read_list_length(PlyType type) {
    const Value length = read_value(type);
    if (!(length.number >= 0) || length.number > static_cast<double>(content_.text.size())) {
      scanner_.truncated();
    }
    return static_cast<std::size_t>(length.number);
  }

  void read_vertices(const PlySection& section) {
    static constexpr std::array<std::string_view, 3> kAxes = {"x", "y", "z"};
    std::vector<std::optional<Column>> columns;
    std::array<bool, 3> has{};
    bool single = true;
    for (const PlyProperty& property : section.properties) {
      const auto axis = std::find(kAxes.begin(), kAxes.end(), property.name);
      columns.emplace_back();
      if (property.count) continue;  // kept in the file
      if (axis == kAxes.end()) {
        columns.back() = Column{property.name, false, {}};
      } else {
        has[static_cast<std::size_t>(axis - kAxes.begin())] = true;
        single = single && property.type.bytes == 4 && property.type.kind == PlyKind::real;
        if (property.type.kind != PlyKind::real) {
          fail("FORMAT_ERROR", path_, "its coordinates are integers");
        }
      }
    }
    if (!(has[0] && has[1] && has[2])) fail("FORMAT_ERROR", path_, "its vertices lack x, y or z");

    for (std::size_t row = 0; row < section.row_count; ++row) {
      std::array<std::string_view, 3> words{};
      for (std::size_t place = 0; place < section.properties.size(); ++place) {
        const PlyProperty& property = section.properties[place];
        if (property.count) {
          skip_list(property);
          continue;
        }
        const Value value = read_value(property.type);
        if (columns[place]) {
          columns[place]->values.push_back(value.number);
        } else {
          words[static_cast<std::size_t>(property.name[0] - 'x')] = value.word;
        }
      }
      content_.fields.add(static_cast<std::int64_t>(row), words, scanner_);
      finish_row(section, row);
    }
    store_points(single);
    for (std::optional<Column>& column : columns) {
      if (column) dataset_.add_node_column(std::move(*column));
    }
  }

  void store_points(bool single) {
    if (!single) {
      dataset_.set_positions(content_.fields.positions);
      return;
    }
    std::vector<Vec3f> nodes;
    for (Vec3d& position : content_.fields.positions) {
      nodes.push_back(vec3_cast<float>(position));
      position = vec3_cast<double>(nodes.back());
    }
    dataset_.set_positions(std::move(nodes));
  }

  void skip_list(const PlyProperty& property) {
    for (std::size_t count = read_list_length(*property.count); count > 0; --count) {
      (void)read_value(property.type);
    }
  }

  void read_others(const PlySection& section) {
    const bool strips = section.name == "tristrips";
    const auto has_nodes = [&](const PlyProperty& property) {
      return (strips || section.name == "face") && property.count &&
             (property.name == "vertex_indices" || property.name == "vertex_index");
    };
    if ((strips || section.name == "face") && section.row_count > 0 &&
        std::ranges::none_of(section.properties, has_nodes)) {
      fail("FORMAT_ERROR", path_,
           "its element " + section.name + " has no list vertex_indices or vertex_index");
    }
    std::vector<std::int64_t> nodes;
    for (std::size_t row = 0; row < section.row_count; ++row) {
      for (const PlyProperty& property : section.properties) {
        if (!has_nodes(property)) {
          if (property.count) skip_list(property);
          if (!property.count) (void)read_value(property.type);
          continue;
        }
        nodes.clear();
        for (std::size_t count = read_list_length(*property.count); count > 0; --count) {
          nodes.push_back(node_of(read_value(property.type)));
        }
        if (strips) insert_strip(nodes);
        if (!strips) insert_face(nodes);
      }
      finish_row(section, row);
    }
  }

  std::int64_t node_of(const Value& value) const {
    constexpr double kMost = std::numeric_limits<NodeId>::max();
    if (!(std::abs(value.number) <= kMost) || std::trunc(value.number) != value.number) {
      scanner_.refuse("the number of a vertex", std::to_string(value.number));
    }
    return static_cast<std::int64_t>(value.number);
  }

  void insert_face(const std::vector<std::int64_t>& face) {
    const CellKind* kind = find_vtk_cell(kPolygonCell, face.size());
    dataset_.add_cell(kind == nullptr ? kPolygonCell : kind->vtk_type, face);
  }

  /// The triangles of strips, between which -1 stands; every other one is seen from behind. Those
  /// with a repeated node only lead to the next.
  void insert_strip(const std::vector<std::int64_t>& nodes) {
    std::size_t first = 0;
    for (std::size_t last = 0; last < nodes.size(); ++last) {
      if (nodes[last] == -1) first = last + 1;
      if (last < first + 2) continue;
      std::array<std::int64_t, 3> triangle = {nodes[last - 2], nodes[last - 1], nodes[last]};
      if ((last - first) % 2 != 0) std::swap(triangle[0], triangle[1]);
      if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) {
        continue;
      }
      dataset_.add_cell(kTriangleCell, triangle);
    }
  }

  const std::filesystem::path& path_;
  FileContent& content_;
  PlainDataset& dataset_;
  Notes notes_;
  Scanner scanner_;
  PlyHeader header_;
};

template <class T>
void append_bytes(std::string& bytes, T value) {
  static_assert(std::endian::native == std::endian::little);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

bool is_face(const Cell& cell) {
  const CellKind* kind = find_vtk_cell(cell.type, cell.nodes.size());
  return cell.type == kPolygonCell || (kind != nullptr && kind->dimension == 2);
}

/// Nodes and faces, binary, in the mesh's own precision.
std::string make_ply(const MeshFile& file) {
  const std::shared_ptr<const Dataset> dataset = dataset_of(file);
  Cell cell;
  std::size_t face_count = 0;
  std::size_t widest = 0;
  for (std::int64_t id = 0; id < dataset->cell_count(); ++id) {
    dataset->get_cell(id, cell);
    if (!is_face(cell)) continue;
    ++face_count;
    widest = std::max(widest, cell.nodes.size());
  }
  const bool wide = widest > std::numeric_limits<std::uint8_t>::max();
  std::string faces;
  for (std::int64_t id = 0; id < dataset->cell_count(); ++id) {
    dataset->get_cell(id, cell);
    if (!is_face(cell)) continue;
    if (wide) append_bytes(faces, static_cast<std::uint32_t>(cell.nodes.size()));
    if (!wide) append_bytes(faces, static_cast<std::uint8_t>(cell.nodes.size()));
    for (const std::int64_t node : cell.nodes) append_bytes(faces, static_cast<std::int32_t>(node));
  }
  return std::visit(
      [&](const auto& nodes) {
        using Real = decltype(nodes[0].x);
        const std::string real = sizeof(Real) == 4 ? "float" : "double";
        std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                            std::to_string(nodes.size()) + '\n';
        for (const char* axis : {"x", "y", "z"}) bytes += "property " + real + ' ' + axis + '\n';
        bytes += "element face " + std::to_string(face_count) + "\nproperty list " +
                 (wide ? "uint" : "uchar") + " int vertex_indices\nend_header\n";
        for (const auto& node : nodes) {
          for (const auto value : {node.x, node.y, node.z}) append_bytes(bytes, value);
        }
        return bytes + faces;
      },
      file.mesh.positions);
}

}  // namespace

MeshFile read_ply(const std::filesystem::path& path) {
  FileContent content;
  content.extension = ".ply";
  content.text = read_bytes(path);
  const auto dataset = std::make_shared<PlainDataset>();
  PlyReader(path, content, *dataset).read();
  content.dataset = dataset;
  return make_mesh_file(path, std::move(content));
}

void write_ply(const std::filesystem::path& path, const MeshFile& file) {
  if (file.content() && file.content()->extension == ".ply") {
    write_bytes(path, replace_coordinates(file.content()->text, file.content()->fields,
                                          file.mesh.positions_view()));
    return;
  }
  for (const ElementBlock& block : file.mesh.blocks) {
    if (element_shape(block.type).dimension == 3 || is_second_order(block.type)) {
      fail("ELEMENT_NOT_SUPPORTED", path,
           ".ply files cannot carry a " + std::string(element_name(block.type)));
    }
  }
  check_held_cells(path, file, {kPolygonCell});
  write_bytes(path, make_ply(file));
}

}  // namespace meshsmooth::formats
