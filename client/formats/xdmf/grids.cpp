#include "xdmf/grids.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>

namespace meshsmooth::formats {
namespace {

bool is_called(const std::string& text, std::string_view name) {
  return std::ranges::equal(text, name, {}, [](unsigned char c) { return std::tolower(c); });
}

/// The topologies and geometries that a grid includes from other places in the file.
std::vector<XmlElement> included(const XdmfData& data, const XmlElement& grid) {
  constexpr std::string_view kScheme = "xpointer(";
  std::vector<XmlElement> all;
  for (const XmlElement& include : grid.children("include")) {
    const std::string pointer = include.attribute("xpointer");
    if (!include.attribute("href").empty()) {
      data.fail("the grid \"" + grid.attribute("Name") + "\" includes the file \"" +
                include.attribute("href") + "\"; only what is in the same file can be read");
    }
    if (!pointer.starts_with(kScheme) || !pointer.ends_with(')')) continue;
    const std::string xpath = pointer.substr(kScheme.size(), pointer.size() - kScheme.size() - 1);
    const std::vector<XmlElement> found = data.find(xpath);
    all.insert(all.end(), found.begin(), found.end());
  }
  return all;
}

std::optional<XmlElement> own_part(const XdmfData& data, const XmlElement& grid,
                                   const std::string& name) {
  const std::vector<XmlElement> parts = grid.children(name);
  if (parts.size() > 1) {
    data.fail("the grid \"" + grid.attribute("Name") + "\" has several <" + name + ">");
  }
  if (parts.empty()) return std::nullopt;
  return data.resolved(parts.front());
}

XdmfGrid read_grid(const XdmfData& data, const XmlElement& element) {
  XdmfGrid grid{
      element, own_part(data, element, "Topology"), own_part(data, element, "Geometry"), false, {}};
  if (grid.topology && grid.geometry) return grid;
  for (const XmlElement& part : included(data, element)) {
    if (part.name() == "Topology" && !grid.topology) grid.topology = part;
    if (part.name() == "Geometry" && !grid.geometry) {
      grid.geometry = part;
      grid.included_geometry = true;
    }
  }
  return grid;
}

std::vector<XdmfGrid> grids_of(const XdmfData& data, const XmlElement& parent);

/// All steps of a temporal collection, by those of its first one.
std::vector<XdmfGrid> grids_of_steps(const XdmfData& data, const XmlElement& collection) {
  std::vector<XdmfGrid> first;
  bool is_first = true;
  for (const XmlElement& step : collection.children("Grid")) {
    std::vector<XdmfGrid> grids = grids_of(data, step);
    if (std::exchange(is_first, false)) {
      first = std::move(grids);
      continue;
    }
    if (grids.size() != first.size()) {
      data.fail("the steps of the collection \"" + collection.attribute("Name") + "\" have " +
                std::to_string(first.size()) + " and " + std::to_string(grids.size()) + " grids");
    }
    for (std::size_t index = 0; index < grids.size(); ++index) {
      std::vector<XdmfGrid> later = std::move(grids[index].later);
      first[index].later.push_back(std::move(grids[index]));
      for (XdmfGrid& grid : later) first[index].later.push_back(std::move(grid));
    }
  }
  return first;
}

/// Of a grid: itself, or those of the collection that it is.
std::vector<XdmfGrid> grids_of(const XdmfData& data, const XmlElement& grid) {
  if (!grid.attribute("Reference").empty()) {
    data.fail("the grid \"" + grid.attribute("Name") + "\" refers to another one");
  }
  const std::vector<XmlElement> children = grid.children("Grid");
  if (children.empty() && !is_called(grid.attribute("GridType"), "collection") &&
      !is_called(grid.attribute("GridType"), "tree")) {
    return {read_grid(data, grid)};
  }
  if (is_called(grid.attribute("CollectionType"), "temporal")) return grids_of_steps(data, grid);
  std::vector<XdmfGrid> all;
  for (const XmlElement& child : children) {
    for (XdmfGrid& found : grids_of(data, child)) all.push_back(std::move(found));
  }
  return all;
}

}  // namespace

std::vector<XdmfGrid> find_xdmf_grids(const XdmfData& data) {
  std::vector<XdmfGrid> all;
  for (const XmlElement& domain : data.root().children("Domain")) {
    for (const XmlElement& grid : domain.children("Grid")) {
      for (XdmfGrid& found : grids_of(data, grid)) all.push_back(std::move(found));
    }
  }
  return all;
}

}  // namespace meshsmooth::formats
