#pragma once

#include <CLI/App.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mesh_file.hpp"
#include "meshsmooth/shape_metrics.hpp"
#include "requirement.hpp"

namespace meshsmooth::cli {

/// What `quality` measures of each element on request, and where that goes.
struct ElementTableFlags {
  std::vector<std::string> metrics;       // names; "all"
  std::vector<std::string> requirements;  // texts
  std::optional<std::filesystem::path> csv, json, npz;

  /// Whether anything needs a table.
  [[nodiscard]] bool any() const {
    return !metrics.empty() || !requirements.empty() || csv || json || npz;
  }
};

/// Adds the flags to a command; `flags` must outlive it.
void add_element_table_flags(CLI::App& command, ElementTableFlags& flags);

/// The parsed requirements, once all files are known to be writable. Throws `InvalidOption`,
/// `Error` (FILE_NOT_WRITABLE).
[[nodiscard]] std::vector<Requirement> check_element_table(const ElementTableFlags& flags);

/// The metrics that the table is to have: those of the reports that some element of the mesh has,
/// those of `--metrics` and those of the requirements.
[[nodiscard]] std::vector<ElementMetric> table_metrics(const ElementTableFlags& flags,
                                                       const std::vector<Requirement>& requirements,
                                                       const Mesh& mesh);

[[nodiscard]] ElementTable measure_table(const Mesh& mesh, std::vector<ElementMetric> metrics);

/// Writes the files of `--csv`, `--npz` and `--elements-json`: id, type, centre, state and metrics
/// of each element.
void write_element_table(const ElementTableFlags& flags, const formats::MeshFile& file,
                         const ElementTable& table);

/// A line for each metric of `--metrics` that the table of `quality` does not have, and the
/// statistics over faces.
[[nodiscard]] std::string describe_table(const ElementTable& table);
/// The same as members of a JSON object: "shape_metrics" and, with metrics of faces, "faces".
[[nodiscard]] std::string table_json(const ElementTable& table);

/// A line for each requirement, and the worst elements of those that are not met.
[[nodiscard]] std::string describe_requirement(const Requirement& requirement,
                                               const RequirementResult& result,
                                               const formats::MeshFile& file);

}  // namespace meshsmooth::cli
