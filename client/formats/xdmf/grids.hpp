#pragma once

#include <optional>
#include <string>
#include <vector>

#include "xdmf/data.hpp"

namespace meshsmooth::formats {

/// A <Grid> that is no collection.
struct XdmfGrid {
  XmlElement element;
  std::optional<XmlElement> topology;
  std::optional<XmlElement> geometry;
  bool included_geometry;       // another grid's, by <xi:include>
  std::vector<XdmfGrid> later;  // the same grid at the later steps of a temporal collection

  [[nodiscard]] std::string name() const { return element.attribute("Name"); }
};

/// All grids of the file, in its order, those of temporal collections by their first steps. Throws
/// FORMAT_ERROR where the steps of a collection have other numbers of grids.
[[nodiscard]] std::vector<XdmfGrid> find_xdmf_grids(const XdmfData& data);

}  // namespace meshsmooth::formats
