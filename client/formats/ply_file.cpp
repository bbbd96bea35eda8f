#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "cells.hpp"
#include "content.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

// VTK's reader crashes on damaged files, and keeps neither float64 nor any
// property that it does not know; its writer knows no float64 either.

enum class Kind { integer, natural, real };

struct Type {
  std::size_t bytes;
  Kind kind;
};

struct Property {
  std::string name;
  Type type;
  std::optional<Type> count;  // of a list
};

struct Section {
  std::string name;
  std::size_t row_count;
  std::vector<Property> properties;
};

struct Header {
  bool text = false;
  bool big_endian = false;
  std::vector<Section> sections;
};

Type read_type(Scanner& scanner) {
  static const std::map<std::string_view, Type> types = {
      {"char", {1, Kind::integer}},   {"int8", {1, Kind::integer}},
      {"uchar", {1, Kind::natural}},  {"uint8", {1, Kind::natural}},
      {"short", {2, Kind::integer}},  {"int16", {2, Kind::integer}},
      {"ushort", {2, Kind::natural}}, {"uint16", {2, Kind::natural}},
      {"int", {4, Kind::integer}},    {"int32", {4, Kind::integer}},
      {"uint", {4, Kind::natural}},   {"uint32", {4, Kind::natural}},
      {"float", {4, Kind::real}},     {"float32", {4, Kind::real}},
      {"double", {8, Kind::real}},    {"float64", {8, Kind::real}}};
  const std::string_view name = scanner.token();
  const auto found = types.find(name);
  if (found == types.end()) scanner.refuse("a PLY type", name);
  return found->second;
}

Header read_header(Scanner& scanner) {
  Header header;
  bool has_vertices = false;
  if (const auto word = scanner.token(); word != "ply") scanner.refuse("ply", word);
  scanner.line();
  for (auto word = scanner.token(); word != "end_header"; word = scanner.token()) {
    if (word == "format") {
      const std::string_view format = scanner.token();
      header.text = format == "ascii";
      header.big_endian = format == "binary_big_endian";
      if (!header.text && !header.big_endian && format != "binary_little_endian") {
        scanner.refuse("a PLY format", format);
      }
    } else if (word == "element") {
      std::string name(scanner.token());
      if (name == "vertex" && has_vertices) scanner.refuse("one list of vertices", name);
      has_vertices = has_vertices || name == "vertex";
      header.sections.push_back({std::move(name), scanner.count(), {}});
    } else if (word == "property") {
      if (header.sections.empty()) scanner.refuse("element", word);
      Property property{{}, {}, std::nullopt};
      Scanner ahead = scanner;
      if (ahead.token() == "list") {
        scanner.token();
        property.count = read_type(scanner);
      }
      property.type = read_type(scanner);
      property.name = scanner.token();
      header.sections.back().properties.push_back(property);
    } else if (word != "comment" && word != "obj_info") {
      scanner.refuse("a PLY header", word);
    }
    scanner.line();
  }
  scanner.line();
  return header;
}

template <class T>
double decode(std::string_view word, bool big_endian) {
  std::array<char, sizeof(T)> bytes{};
  std::copy_n(word.begin(), bytes.size(), bytes.begin());  // it has no other size
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return static_cast<double>(std::bit_cast<T>(bytes));
}

double decode(std::string_view word, Type type, bool big_endian) {
  if (type.kind == Kind::real) {
    return type.bytes == 4 ? decode<float>(word, big_endian) : decode<double>(word, big_endian);
  }
  const bool natural = type.kind == Kind::natural;
  if (type.bytes == 1) {
    return natural ? decode<std::uint8_t>(word, big_endian) : decode<std::int8_t>(word, big_endian);
  }
  if (type.bytes == 2) {
    return natural ? decode<std::uint16_t>(word, big_endian)
                   : decode<std::int16_t>(word, big_endian);
  }
  return natural ? decode<std::uint32_t>(word, big_endian) : decode<std::int32_t>(word, big_endian);
}

/// Reads the rows that the header announces.
class PlyReader {
 public:
  PlyReader(const std::filesystem::path& path, FileContent& content, PlainDataset& dataset)
      : path_(path),
        content_(content),
        dataset_(dataset),
        scanner_(path, content.text),
        header_(read_header(scanner_)) {
    content_.fields.style = header_.text         ? NumberStyle::shortest
                            : header_.big_endian ? NumberStyle::binary_swapped
                                                 : NumberStyle::binary;
  }

  void read() {
    for (const Section& section : header_.sections) {
      if (section.name == "vertex") {
        read_vertices(section);
      } else {
        read_others(section);
      }
    }
  }

 private:
  struct Value {
    std::string_view word;
    double number;
  };

  Value read_value(Type type) {
    if (header_.text) {
      const std::string_view word = scanner_.token();
      return {word, scanner_.parse<double>(word)};
    }
    const std::string_view word = scanner_.bytes(type.bytes);
    return {word, decode(word, type, header_.big_endian)};
  }

  std::size_t read_list_length(Type type) {
    const Value length = read_value(type);
    if (!(length.number >= 0) || length.number > static_cast<double>(content_.text.size())) {
      scanner_.truncated();
    }
    return static_cast<std::size_t>(length.number);
  }

  void read_vertices(const Section& section) {
    static constexpr std::array<std::string_view, 3> kAxes = {"x", "y", "z"};
    std::vector<std::optional<Column>> columns;
    std::array<bool, 3> has{};
    bool single = true;
    for (const Property& property : section.properties) {
      if (property.count) fail("FORMAT_ERROR", path_, "a vertex has a list, " + property.name);
      const auto axis = std::find(kAxes.begin(), kAxes.end(), property.name);
      columns.emplace_back();
      if (axis == kAxes.end()) {
        columns.back() = Column{property.name, false, {}};
      } else {
        has[static_cast<std::size_t>(axis - kAxes.begin())] = true;
        single = single && property.type.bytes == 4 && property.type.kind == Kind::real;
        if (property.type.kind != Kind::real) {
          fail("FORMAT_ERROR", path_, "its coordinates are integers");
        }
      }
    }
    if (!(has[0] && has[1] && has[2])) fail("FORMAT_ERROR", path_, "its vertices lack x, y or z");

    for (std::size_t row = 0; row < section.row_count; ++row) {
      std::array<std::string_view, 3> words{};
      for (std::size_t place = 0; place < section.properties.size(); ++place) {
        const Property& property = section.properties[place];
        const Value value = read_value(property.type);
        if (columns[place]) {
          columns[place]->values.push_back(value.number);
        } else {
          words[static_cast<std::size_t>(property.name[0] - 'x')] = value.word;
        }
      }
      content_.fields.add(static_cast<std::int64_t>(row), words, scanner_);
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

  void read_others(const Section& section) {
    std::vector<std::int64_t> face;
    for (std::size_t row = 0; row < section.row_count; ++row) {
      for (const Property& property : section.properties) {
        const std::size_t count = property.count ? read_list_length(*property.count) : 1;
        const bool is_face = section.name == "face" && property.count &&
                             (property.name == "vertex_indices" || property.name == "vertex_index");
        face.clear();
        for (std::size_t value = 0; value < count; ++value) {
          const Value number = read_value(property.type);
          if (is_face) face.push_back(node_of(number));
        }
        if (is_face) insert_face(face);
      }
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

  const std::filesystem::path& path_;
  FileContent& content_;
  PlainDataset& dataset_;
  Scanner scanner_;
  Header header_;
};

template <class T>
void append_bytes(std::string& bytes, T value) {
  static_assert(std::endian::native == std::endian::little);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Nodes and faces, binary, in the mesh's own precision.
std::string make_ply(const MeshFile& file) {
  const std::shared_ptr<const Dataset> dataset = dataset_of(file);
  std::string faces;
  std::size_t face_count = 0;
  Cell cell;
  for (std::int64_t id = 0; id < dataset->cell_count(); ++id) {
    dataset->get_cell(id, cell);
    const CellKind* kind = find_vtk_cell(cell.type, cell.nodes.size());
    if (kind == nullptr || kind->dimension != 2) continue;
    append_bytes(faces, static_cast<std::uint8_t>(cell.nodes.size()));
    for (const std::int64_t node : cell.nodes) append_bytes(faces, static_cast<std::int32_t>(node));
    ++face_count;
  }
  return std::visit(
      [&](const auto& nodes) {
        using Real = decltype(nodes[0].x);
        const std::string real = sizeof(Real) == 4 ? "float" : "double";
        std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                            std::to_string(nodes.size()) + '\n';
        for (const char* axis : {"x", "y", "z"}) bytes += "property " + real + ' ' + axis + '\n';
        bytes += "element face " + std::to_string(face_count) +
                 "\nproperty list uchar int vertex_indices\nend_header\n";
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
  write_bytes(path, make_ply(file));
}

}  // namespace meshsmooth::formats
