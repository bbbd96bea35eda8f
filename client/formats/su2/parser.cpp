#include "parser.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include "cells.hpp"

namespace meshsmooth::formats {
namespace {

constexpr char kComment = '%';
constexpr std::string_view kHalo = "SEND_RECEIVE";  // of a partition: no boundary

}  // namespace

Su2Parser::Su2Parser(std::filesystem::path file, std::string_view text)
    : file_(std::move(file)), scanner_(file_, text, kComment) {}

Su2Parser::Setting Su2Parser::parse_setting(std::string_view line) {
  line = line.substr(0, line.find(kComment));
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos) return {};
  const std::string_view value = trimmed(line.substr(equals + 1));
  std::string name(trimmed(line.substr(0, equals)));
  std::ranges::transform(name, name.begin(), [](unsigned char letter) {
    return static_cast<char>(std::toupper(letter));
  });
  return {std::move(name), value.substr(0, value.find_first_of(" \t"))};
}

void Su2Parser::parse() {
  bool in_unknown = false;
  while (!scanner_.at_end()) {
    const Setting setting = parse_setting(scanner_.peek_line());
    if (setting.name.empty()) {
      if (!in_unknown) scanner_.refuse("a keyword like NDIME=", scanner_.peek_line());
      scanner_.line();
      continue;
    }
    in_unknown = !read(setting);
  }
  finish_zone();
  if (zone_count_ != 0 && zone_count_ != zones_.size()) {
    fail("FILE_TRUNCATED", file_,
         "NZONE announces " + std::to_string(zone_count_) + " zones, there are " +
             std::to_string(zones_.size()));
  }
}

/// False: a keyword that is not about the mesh; what follows is not read.
bool Su2Parser::read(const Setting& setting) {
  const auto& [name, value] = setting;
  if (name == "NELEM") {
    once(zone_.has_elements, name);
    read_elements(count(value));
    return true;
  }
  if (name == "NPOIN") {
    once(zone_.has_points, name);
    if (dimension_ == 0) find_dimension();
    read_points(count(value));
    return true;
  }
  if (name == "MARKER_ELEMS") {
    read_marker(count(value));
    return true;
  }
  if (name == "NDIME") {
    set_dimension(value);
  } else if (name == "NZONE") {
    zone_count_ = scanner_.parse<std::size_t>(value);
    if (zone_count_ == 0) scanner_.refuse("one zone or more", value);
  } else if (name == "IZONE") {
    start_zone(value);
  } else if (name == "NMARK") {
    once(zone_.has_marker_count, name);
    zone_.marker_count = scanner_.parse<std::size_t>(value);
  } else if (name == "MARKER_TAG") {
    marker_ = value;
    if (marker_.empty()) scanner_.refuse("the name of a marker", value);
  } else {
    scanner_.line();
    return name == "SEND_RECV";
  }
  scanner_.line();
  return true;
}

void Su2Parser::set_dimension(std::string_view value) {
  if (value != "2" && value != "3") scanner_.refuse("2 or 3 dimensions", value);
  const int dimension = value == "2" ? 2 : 3;
  if (dimension_ != 0 && dimension_ != dimension) {
    scanner_.refuse("as many dimensions as before", value);
  }
  dimension_ = dimension;
}

/// It may stand after the points.
void Su2Parser::find_dimension() {
  Scanner ahead = scanner_;
  while (!ahead.at_end()) {
    const Setting setting = parse_setting(ahead.line());
    if (setting.name == "NDIME") {
      set_dimension(setting.value);
      return;
    }
  }
  fail("FILE_TRUNCATED", file_, "there is no NDIME=");
}

void Su2Parser::start_zone(std::string_view number) {
  if (zone_.has_elements || zone_.has_points) finish_zone();
  (void)scanner_.parse<std::size_t>(number);
  zone_ = {};
  zone_.number = number;
  zone_.first_node = fields_.positions.size();
  zone_.first_element = elements_.size();
  zone_.first_facet = facets_.size();
}

/// Checks what it announces, and numbers its nodes as those of the mesh.
void Su2Parser::finish_zone() {
  const std::string prefix = zone_prefix();
  if (!zone_.has_elements) fail("FILE_TRUNCATED", file_, prefix + "there is no NELEM=");
  if (!zone_.has_points) fail("FILE_TRUNCATED", file_, prefix + "there is no NPOIN=");
  if (zone_.has_marker_count && zone_.marker_count != zone_.markers_found) {
    fail("FILE_TRUNCATED", file_,
         prefix + "NMARK announces " + std::to_string(zone_.marker_count) + " markers, there are " +
             std::to_string(zone_.markers_found));
  }
  if (!zone_.has_marker_count && zone_.markers_found > 0) {
    notes_.add("no marker count", [&] { return prefix + "there is no NMARK= for its markers"; });
  }
  check_nodes(elements_, zone_.first_element, "element");
  check_nodes(facets_, zone_.first_facet, "element of a marker");
  element_zones_.resize(elements_.size(), zones_.size());
  facet_zones_.resize(facets_.size(), zones_.size());
  zones_.push_back(zone_.number);
}

void Su2Parser::check_nodes(std::vector<Cell>& cells, std::size_t first,
                            const std::string& what) const {
  const auto node_count = static_cast<std::int64_t>(fields_.positions.size() - zone_.first_node);
  for (std::size_t index = first; index < cells.size(); ++index) {
    for (std::int64_t& node : cells[index].nodes) {
      if (node < 0 || node >= node_count) {
        fail("FORMAT_ERROR", file_,
             zone_prefix() + what + " " + std::to_string(index - first) + " uses node " +
                 std::to_string(node) + ", there are only " + std::to_string(node_count));
      }
      node += static_cast<std::int64_t>(zone_.first_node);
    }
  }
}

/// "zone 2: ", where the file has several.
std::string Su2Parser::zone_prefix() const {
  if (zone_.number.empty() || (zones_.empty() && zone_count_ < 2)) return "";
  return "zone " + zone_.number + ": ";
}

void Su2Parser::store(FileContent& content) {
  auto dataset = std::make_shared<PlainDataset>();
  for (const auto* cells : {&elements_, &facets_}) {
    for (const Cell& cell : *cells) dataset->add_cell(cell.type, cell.nodes);
  }
  dataset->set_positions(fields_.positions);
  Column column{kSu2MarkerArray, true, std::vector<double>(elements_.size(), 0)};
  column.values.insert(column.values.end(), facet_markers_.begin(), facet_markers_.end());
  if (!facets_.empty()) dataset->add_cell_column(std::move(column));
  if (zones_.size() > 1) {
    Column zones{kSu2ZoneArray, true, {}};
    for (const auto* of : {&element_zones_, &facet_zones_}) {
      for (const std::size_t zone : *of) zones.values.push_back(static_cast<double>(zone + 1));
    }
    dataset->add_cell_column(std::move(zones));
    std::vector<NodeSet> nodes;
    for (const std::string& number : zones_) nodes.push_back({"zone " + number, {}});
    for (std::size_t element = 0; element < elements_.size(); ++element) {
      auto& set = nodes[element_zones_[element]].nodes;
      for (const auto node : elements_[element].nodes) set.push_back(static_cast<NodeId>(node));
    }
    content.node_sets = std::move(nodes);
  }
  for (const auto& [name, number] : markers_) {
    content.groups.push_back({dimension_ - 1, name, kSu2MarkerArray, {number}});
  }
  content.notes = notes_.texts();
  content.dataset = std::move(dataset);
}

// --- lists ---------------------------------------------------------------------

void Su2Parser::once(bool& has, std::string_view name) const {
  if (has) scanner_.refuse(std::string(name) + " once", "a second one");
  has = true;
}

/// Also moves to the next line.
std::size_t Su2Parser::count(std::string_view value) {
  const auto number = scanner_.parse<std::size_t>(value);
  scanner_.line();
  return number;
}

void Su2Parser::read_points(std::size_t count) {
  const auto dimension = static_cast<std::size_t>(dimension_);
  for (std::size_t point = 0; point < count; ++point) {
    std::array<CoordinateFields::Field, 3> found{};
    std::array<double, 3> values{};
    (void)scanner_.at_end();  // to the next line that is no comment
    for (std::size_t axis = 0; axis < dimension; ++axis) {
      const std::string_view word = token();
      values[axis] = scanner_.parse<double>(word);
      found[axis] = {scanner_.offset_of(word), word.size()};
    }
    scanner_.line();
    fields_.node_ids.push_back(static_cast<std::int64_t>(fields_.positions.size()));
    fields_.fields.push_back(found);
    fields_.positions.push_back({values[0], values[1], values[2]});
  }
}

/// "VTK-type node node … [number]".
void Su2Parser::read_cell(Cell& cell) {
  (void)scanner_.at_end();
  const std::string_view word = token();
  cell.type = scanner_.parse<int>(word);
  const CellKind* kind = find_vtk_cell(cell.type);
  if (kind == nullptr || is_second_order(*kind)) {
    fail("ELEMENT_NOT_SUPPORTED", file_,
         zone_prefix() + "element " + std::to_string(elements_.size() - zone_.first_element) +
             " is of the type " + PlainDataset().cell_name(cell.type) +
             "; only linear triangles, quads, tetrahedra, pyramids, wedges and hexahedra can be "
             "smoothed");
  }
  cell.nodes.clear();
  for (int corner = 0; corner < kind->node_count; ++corner) {
    cell.nodes.push_back(scanner_.parse<std::int64_t>(token()));
  }
  scanner_.line();
}

/// The next one of this line.
std::string_view Su2Parser::token() {
  const std::string_view word = scanner_.token_on_line();
  if (word.empty() && scanner_.at_end()) scanner_.truncated();
  if (word.empty()) scanner_.refuse("more numbers in the line before", word);
  if (word.find('=') != std::string_view::npos) scanner_.refuse("a number", word);
  return word;
}

void Su2Parser::read_elements(std::size_t count) {
  Cell cell;
  for (std::size_t element = 0; element < count; ++element) {
    read_cell(cell);
    elements_.push_back(cell);
  }
}

void Su2Parser::read_marker(std::size_t count) {
  if (marker_.empty()) scanner_.refuse("MARKER_TAG= before MARKER_ELEMS=", "");
  ++zone_.markers_found;
  ++marker_number_;
  const bool halo = marker_ == kHalo;
  if (halo && !parse_setting(scanner_.peek_line()).name.empty()) scanner_.line();  // SEND_TO=
  Cell cell;
  for (std::size_t facet = 0; facet < count; ++facet) {
    read_cell(cell);
    if (halo) continue;
    for (const std::int64_t node : cell.nodes) {
      if (node < 0 || node != static_cast<NodeId>(node)) {
        scanner_.refuse("the number of a node", std::to_string(node));
      }
    }
    facets_.push_back(cell);
    facet_markers_.push_back(static_cast<double>(marker_number_));
  }
  if (!halo) markers_.push_back({marker_, static_cast<int>(marker_number_)});
  marker_.clear();
}

}  // namespace meshsmooth::formats
