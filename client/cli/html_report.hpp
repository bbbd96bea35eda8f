#pragma once

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "mesh_file.hpp"
#include "meshsmooth/client.hpp"

namespace meshsmooth::cli {

/// The input of a job, for the report: its result replaces the positions.
struct KeptInput {
  std::filesystem::path path;
  std::variant<std::vector<Vec3f>, std::vector<Vec3d>> positions;
  JobInput given = {};
};

/// One page of HTML about a job, which needs nothing else: the summary in words, histograms, and a
/// drawing of the boundary and the worst elements before and after. At most 1.5 MB, and 60 B for
/// each triangle drawn. O(elements).
///
/// @param file the input with the positions of the result
[[nodiscard]] std::string job_html(const KeptInput& input, const std::filesystem::path& output,
                                   const formats::MeshFile& file,
                                   const client::SmoothReport& report, const SmoothOptions& options,
                                   double total_seconds);

/// The same about the quality of a mesh file.
[[nodiscard]] std::string quality_html(const std::filesystem::path& path,
                                       const formats::MeshFile& file, const QualityStats& stats);

}  // namespace meshsmooth::cli
