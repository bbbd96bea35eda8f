#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "inner_cells.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/summary.hpp"

namespace meshsmooth::cli {

/// One character a bin; any element at all shows.
[[nodiscard]] std::string draw_histogram(const std::vector<std::int64_t>& bins);

/// Every metric with its histogram, what is inverted or degenerate, and the
/// worst elements under the names the file gives them.
[[nodiscard]] std::string describe_quality(
    const QualityStats& stats, const std::function<std::int64_t(std::int64_t)>& file_element_id);

/// `MeshFile::notes`, a line each.
[[nodiscard]] std::string describe_notes(const formats::MeshFile& file);

/// A line on the elements of each kind that are not written as others are (see
/// canonical_topology.hpp); empty: none are.
[[nodiscard]] std::string describe_reading(
    const QualityStats& stats, const std::function<std::int64_t(std::int64_t)>& file_element_id);

/// One line on the nodes that went back so that nothing became worse, and one on what did; empty:
/// neither.
[[nodiscard]] std::string describe_kept_quality(const SmoothSummary& summary);

/// One line on the cells that hold their nodes because they cannot be smoothed; empty: none do.
[[nodiscard]] std::string describe_held_cells(const formats::MeshFile& file);

/// Which nodes stay because the file has surfaces, lines or points there; empty if none do.
[[nodiscard]] std::string describe_inner_cells(const formats::InnerCells& inner);

}  // namespace meshsmooth::cli
