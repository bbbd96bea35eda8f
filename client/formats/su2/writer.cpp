#include "writer.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "cells.hpp"
#include "content.hpp"
#include "plane.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

void append(std::string& text, double number) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), number);
  text.append(digits.data(), end);
}

void append_line(std::string& text, int type, std::span<const std::int64_t> nodes) {
  text += std::to_string(type);
  for (const std::int64_t node : nodes) text += ' ' + std::to_string(node);
  text += '\n';
}

/// The names of the markers by lower-dimensional cell.
class MarkerNames {
 public:
  MarkerNames(const MeshFile& file, const Dataset& dataset, int dimension) {
    if (file.content()) {
      for (const CellGroup& group : file.content()->groups) {
        if (group.dimension != dimension) continue;
        if (auto column = dataset.cell_column(group.array)) {
          groups_.push_back({group.name, std::move(*column), group.values});
        }
      }
    }
    for (const char* array : {kSu2MarkerArray, kPhysicalArray}) {
      if (!numbers_) numbers_ = dataset.cell_column(array);
    }
  }

  /// Without blanks, which end a name.
  [[nodiscard]] std::string of_cell(std::int64_t id) const {
    const auto cell = static_cast<std::size_t>(id);
    for (const Group& group : groups_) {
      if (std::ranges::find(group.values, group.column.values[cell]) == group.values.end())
        continue;
      std::string name = group.name;
      std::ranges::replace(name, ' ', '_');
      return name;
    }
    const double number = groups_.empty() && numbers_ ? numbers_->values[cell] : 0;
    if (!(number >= 1 && number < 1e9)) return "unnamed";
    return "marker_" + std::to_string(static_cast<std::int64_t>(number));
  }

 private:
  struct Group {
    std::string name;
    Column column;
    std::vector<int> values;
  };
  std::vector<Group> groups_;
  std::optional<Column> numbers_;
};

/// The elements of the mesh, and those of each marker, as lines.
struct Lines {
  std::size_t element_count = 0;
  std::string elements;
  std::map<std::string, std::pair<std::size_t, std::string>> markers;
};

Lines make_lines(const path& file_name, const MeshFile& file, int dimension) {
  const std::shared_ptr<const Dataset> dataset = dataset_of(file);
  const MarkerNames names(file, *dataset, dimension - 1);
  Lines lines;
  Cell cell;
  for (std::int64_t id = 0; id < dataset->cell_count(); ++id) {
    dataset->get_cell(id, cell);
    const CellKind* kind = find_vtk_cell(cell.type, cell.nodes.size());
    const auto cell_dim = cell_dimension(cell.type, cell.nodes.size());
    if (!cell_dim || (kind != nullptr && is_second_order(*kind))) {
      fail("ELEMENT_NOT_SUPPORTED", file_name,
           ".su2 files cannot carry a " + dataset->cell_name(cell.type));
    }
    if (*cell_dim < dimension - 1 || cell.nodes.empty()) continue;
    if (*cell_dim == dimension) {
      ++lines.element_count;
      append_line(lines.elements, kind->vtk_type, cell.nodes);
      continue;
    }
    auto& [count, text] = lines.markers[names.of_cell(id)];
    const std::size_t corners = kind == nullptr ? 2 : cell.nodes.size();  // null: a polyline
    for (std::size_t first = 0; first + corners <= cell.nodes.size(); ++first) {
      ++count;
      append_line(text, kind == nullptr ? kLineCell : kind->vtk_type,
                  std::span(cell.nodes).subspan(first, corners));
    }
  }
  return lines;
}

}  // namespace

std::string make_su2(const path& file_name, const MeshFile& file) {
  int dimension = 2;
  for (const ElementBlock& block : file.mesh.blocks) {
    dimension = std::max(dimension, static_cast<int>(element_shape(block.type).dimension));
  }
  if (dimension == 2) check_plane(file_name, file.mesh);
  const Lines lines = make_lines(file_name, file, dimension);
  std::string text = "NDIME= " + std::to_string(dimension) +
                     "\nNELEM= " + std::to_string(lines.element_count) + '\n' + lines.elements +
                     "NPOIN= " + std::to_string(file.mesh.node_count()) + '\n';
  const auto append_points = [&](const auto& positions) {
    for (const auto& position : positions) {
      const auto place = vec3_cast<double>(position);
      append(text, place.x);
      append(text += ' ', place.y);
      if (dimension == 3) append(text += ' ', place.z);
      text += '\n';
    }
  };
  std::visit(append_points, file.mesh.positions);
  text += "NMARK= " + std::to_string(lines.markers.size()) + '\n';
  for (const auto& [name, marker] : lines.markers) {
    text += "MARKER_TAG= " + name + "\nMARKER_ELEMS= " + std::to_string(marker.first) + '\n' +
            marker.second;
  }
  return text;
}

}  // namespace meshsmooth::formats
