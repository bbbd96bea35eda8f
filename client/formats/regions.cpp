#include "regions.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "content.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

/// The array's values by element of the mesh.
std::optional<Column> element_column(const FileContent& content, const std::string& array) {
  std::optional<Column> cells;
  if (array == kPhysicalArray && !content.group_sets.empty()) {
    cells = Column{array, true, {content.group_sets.begin(), content.group_sets.end()}};
  } else {
    cells = content.dataset->cell_column(array);
  }
  if (!cells) return std::nullopt;
  Column elements{array, cells->whole, {}};
  elements.values.reserve(content.element_cells.size());
  for (const std::int64_t cell : content.element_cells) {
    elements.values.push_back(cells->values[static_cast<std::size_t>(cell)]);
  }
  return elements;
}

/// TetGen's attributes are real numbers by their format, so they may be any.
void check_values(const MeshFile& file, const Column& column) {
  if (column.whole) return;
  const bool attribute = column.name.starts_with(kAttributeArray);
  const auto odd = std::ranges::find_if_not(column.values, [&](double value) {
    return attribute ? !std::isnan(value) : std::trunc(value) == value;
  });
  if (odd == column.values.end()) return;
  const std::string element = std::to_string(file.file_element_id(odd - column.values.begin()));
  throw InvalidOption("ARRAY_NOT_WHOLE",
                      "the cell array \"" + column.name +
                          "\" cannot be used as element regions: element " + element + " has " +
                          std::to_string(*odd) + ", which is no whole number",
                      {{"name", column.name}, {"element", element}});
}

Regions number_regions(const MeshFile& file, const Column& column) {
  check_values(file, column);
  std::map<double, std::int32_t> numbers;
  for (const double value : column.values) numbers.emplace(value, 0);
  std::int32_t next = 0;
  for (auto& [value, number] : numbers) number = next++;
  Regions regions{column.name, numbers.size(), {}};
  if (numbers.size() < 2) return regions;
  regions.of_element.reserve(column.values.size());
  for (const double value : column.values)
    regions.of_element.push_back(numbers.find(value)->second);
  return regions;
}

}  // namespace

Regions find_regions(const MeshFile& file) {
  if (!file.content()) return {};
  const std::string attribute = std::string(kAttributeArray) + "0";
  for (const std::string& array :
       {std::string(kPhysicalArray), std::string(kReferenceArray), attribute,
        std::string(kFamilyArray), std::string(kBlockArray), std::string(kEntityArray),
        std::string(kMaterialArray), std::string(kCellZoneArray), std::string(kSu2ZoneArray),
        std::string(kZoneArray)}) {
    const auto column = element_column(*file.content(), array);
    if (!column) continue;
    const auto tells = [](double value) { return value != 0; };
    if (std::ranges::any_of(column->values, tells)) return number_regions(file, *column);
  }
  return {};
}

Regions find_regions(const MeshFile& file, const std::string& array) {
  const auto column = file.content() ? element_column(*file.content(), array) : std::nullopt;
  if (!column) {
    std::vector<std::string> names;
    if (file.content()) {
      for (const Column& other : file.content()->dataset->cell_columns()) {
        if (other.name != kElementIdArray) names.push_back(other.name);
      }
    }
    fail_unknown_name("no cell array of one number a cell is called", array, names);
  }
  return number_regions(file, *column);
}

}  // namespace meshsmooth::formats
