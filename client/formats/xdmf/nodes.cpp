#include "xdmf/nodes.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <span>
#include <utility>

#include "text.hpp"

namespace meshsmooth::formats {
namespace {

/// How many coordinates a node has, and whether each has an array of its own.
struct Layout {
  std::size_t dimension;
  bool apart;
};

Layout layout_of(const XdmfData& data, const XmlElement& geometry) {
  std::string type = geometry.attribute("GeometryType");
  if (type.empty()) type = geometry.attribute("Type");
  std::ranges::transform(type, type.begin(),
                         [](unsigned char letter) { return std::toupper(letter); });
  if (type.empty() || type == "XYZ") return {3, false};
  if (type == "XY") return {2, false};
  if (type == "X_Y_Z") return {3, true};
  if (type == "X_Y") return {2, true};
  data.fail("the geometry is of the type \"" + type + "\"; XYZ and XY can be read");
}

/// Numbers in the text get other ones there.
constexpr const char* kInText = "<Geometry>";

}  // namespace

std::vector<std::string> XdmfNodeReader::places_of(const XmlElement& geometry) {
  std::vector<std::string> places;
  for (const XmlElement& item : data_.items_of(geometry)) {
    const auto where = data_.reference(item);
    places.push_back(where.file.empty()
                         ? "byte " + std::to_string(data_.offset_of(item, content_.text))
                         : where.file + ":" + where.dataset);
  }
  return places;
}

std::optional<XdmfNodes> XdmfNodeReader::find(const XmlElement& geometry) {
  const auto places = places_of(geometry);
  const auto found = std::ranges::find(known_, places, &Known::places);
  if (found == known_.end()) return std::nullopt;
  return found->nodes;
}

std::vector<std::vector<double>> XdmfNodeReader::numbers(const XmlElement& geometry) {
  const Layout layout = layout_of(data_, geometry);
  const std::vector<XmlElement> items = data_.items_of(geometry);
  if (items.size() != (layout.apart ? layout.dimension : 1)) {
    data_.fail("<Geometry> has not one <DataItem>" +
               std::string(layout.apart ? " for each coordinate" : ""));
  }
  std::vector<std::vector<double>> numbers;
  for (const XmlElement& item : items) {
    numbers.push_back(data_.reals(item));
    data_.check_size(item, numbers.back().size());
  }
  return numbers;
}

bool XdmfNodeReader::have(const XdmfNodes& nodes,
                          const std::vector<std::vector<double>>& numbers) const {
  return std::ranges::any_of(known_, [&](const Known& known) {
    return known.nodes.first == nodes.first && known.numbers == numbers;
  });
}

XdmfNodes XdmfNodeReader::add(const XmlElement& geometry,
                              const std::vector<std::vector<double>>& numbers) {
  const std::size_t dimension = layout_of(data_, geometry).dimension;
  const std::size_t width = numbers.size() == 1 ? dimension : 1;
  const XdmfNodes nodes{count_, static_cast<std::int64_t>(numbers.front().size() / width)};
  append_positions(positions_, keep(geometry, nodes, numbers));
  count_ += nodes.count;
  known_.push_back({places_of(geometry), nodes, numbers});
  return nodes;
}

void XdmfNodeReader::add_copy(const XmlElement& geometry, const XdmfNodes& nodes,
                              const std::vector<std::vector<double>>& numbers) {
  (void)keep(geometry, nodes, numbers);
  known_.push_back({places_of(geometry), nodes, {}});
}

Positions XdmfNodeReader::keep(const XmlElement& geometry, const XdmfNodes& nodes,
                               const std::vector<std::vector<double>>& numbers) {
  CoordinateArrays arrays;
  arrays.dimension = layout_of(data_, geometry).dimension;
  arrays.by_axis = false;
  arrays.first_node = static_cast<std::size_t>(nodes.first);
  arrays.node_count = static_cast<std::size_t>(nodes.count);
  arrays.single_precision = true;
  const std::vector<XmlElement> items = data_.items_of(geometry);
  for (const XmlElement& item : items) {
    const auto where = data_.reference(item);
    const bool in_text = where.file.empty();
    if (!content_.arrays.empty() && in_text != in_text_) {
      data_.fail("some coordinates are in the XML, some in an HDF5 file");
    }
    in_text_ = in_text;
    arrays.names.push_back(in_text ? kInText : where.dataset);
    arrays.single_precision = arrays.single_precision && !in_text &&
                              data_.hdf5(where.file).is_single_precision(where.dataset);
    if (!in_text) keep_companion(where.file);
  }
  Positions positions = positions_of(path_, arrays, numbers);
  if (in_text_) {
    if (items.size() != 1) data_.fail("coordinates in the XML are read as XYZ or XY only");
    keep_fields(items.front(), nodes, arrays.dimension);
  }
  content_.arrays.push_back(std::move(arrays));
  return positions;
}

void XdmfNodeReader::keep_companion(const std::string& file) {
  if (!content_.companion.empty() && content_.companion != file) {
    data_.fail("the coordinates are in several HDF5 files: " + content_.companion.string() + ", " +
               file);
  }
  if (!content_.companion.empty()) return;
  content_.companion = file;
  content_.companion_text = data_.bytes(file);
}

void XdmfNodeReader::keep_fields(const XmlElement& item, const XdmfNodes& nodes,
                                 std::size_t dimension) {
  const std::string_view text = content_.text;
  const std::size_t first = data_.offset_of(item, text);
  const std::size_t end = std::min(text.find('<', first), text.size());
  if (without_space(text.substr(first, end - first)) != item.content()) {
    data_.fail("the coordinates in the XML are not plain numbers there");
  }
  if (content_.segments.empty()) content_.segments.emplace_back();
  TextSegment& segment = content_.segments.front();
  Scanner scanner(path_, text.substr(0, end));
  (void)scanner.bytes(first);
  for (std::int64_t node = nodes.first; !scanner.at_end(); ++node) {
    std::array<double, 3> values{};
    std::array<CoordinateFields::Field, 3> fields = {{{end, 0}, {end, 0}, {end, 0}}};
    for (std::size_t axis = 0; axis < dimension; ++axis) {
      const std::string_view word = scanner.token();
      values[axis] = scanner.parse<double>(word);
      fields[axis] = {scanner.offset_of(word), word.size()};
    }
    segment.fields.fields.push_back(fields);
    segment.fields.positions.push_back({values[0], values[1], values[2]});
    segment.nodes.push_back(static_cast<NodeId>(node));
  }
}

void XdmfNodeReader::store(PlainDataset& dataset) {
  known_.clear();
  dataset.set_positions(std::move(positions_));
}

std::string replace_xdmf_coordinates(const std::filesystem::path& path, const FileContent& content,
                                     const Mesh& mesh) {
  const TextSegment& segment = content.segments.front();
  const PositionsView view = mesh.positions_view();
  // z is not in the text of a flat mesh, and rounding may have left something there.
  for (const CoordinateArrays& arrays : content.arrays) (void)numbers_of(path, arrays, view);
  std::vector<std::size_t> order(segment.nodes.size());
  for (std::size_t place = 0; place < order.size(); ++place) order[place] = place;
  std::ranges::sort(order, {},
                    [&](std::size_t place) { return segment.fields.fields[place][0].begin; });
  CoordinateFields fields;
  std::vector<Vec3d> positions;
  for (const std::size_t place : order) {
    fields.fields.push_back(segment.fields.fields[place]);
    fields.positions.push_back(segment.fields.positions[place]);
    const auto node = static_cast<std::size_t>(segment.nodes[place]);
    Vec3d now = std::visit([&](const auto& all) { return vec3_cast<double>(all[node]); }, view);
    if (fields.fields.back()[2].length == 0) now.z = fields.positions.back().z;
    positions.push_back(now);
  }
  return replace_coordinates(content.text, fields, std::span<const Vec3d>(positions));
}

}  // namespace meshsmooth::formats
