#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mesh_file.hpp"
#include "report/shown_elements.hpp"

/// Parts of a report that are HTML alone. Texts of files and users are escaped here.
namespace meshsmooth::cli {

/// The figures that a reader looks for first. `before` may be null.
[[nodiscard]] std::string figures_html(const QualityStats* before, const QualityStats& after,
                                       std::size_t node_count);

/// A list item for each line, with a capital.
[[nodiscard]] std::string list_html(std::string_view lines);

/// Histogram and table of each metric. `before` may be null.
[[nodiscard]] std::string metrics_html(const QualityStats* before, const QualityStats& after);

/// The first of the elements, with buttons that choose them in the drawing.
[[nodiscard]] std::string worst_html(const DrawnMesh& mesh, std::span<const ShownElement> elements,
                                     const formats::MeshFile& file);

/// Names with values; those without a value are left out.
[[nodiscard]] std::string definitions_html(
    const std::vector<std::pair<std::string, std::string>>& rows);

}  // namespace meshsmooth::cli
