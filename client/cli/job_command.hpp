#pragma once

#include <CLI/App.hpp>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coincident_nodes.hpp"
#include "connection.hpp"
#include "job_output.hpp"
#include "mesh_argument.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/options.hpp"

namespace meshsmooth::cli {

/// What the commands that send a mesh share: where it comes from, what of it stays, who computes.
struct JobFlags {
  MeshArgument input;
  ServerAddress server;
  std::optional<std::filesystem::path> fixed_nodes;
  std::vector<std::string> fixed_sets;
  std::vector<std::string> fixed_types;
  std::vector<std::pair<std::string, std::string>> periodic;  // names of sets
  std::string file_pairs = "on";
  bool merge_coincident = false;
  std::string regions = "auto";
  std::vector<std::string> element_quality;  // names of metrics
  std::string backend = "auto";
  std::optional<double> result_ttl_seconds;
  std::string request_id;
  std::string traceparent;
  JobOutput output;
};

/// Adds the flags to a command; `flags` must outlive it.
void add_job_flags(CLI::App& command, JobFlags& flags, const std::string& input_name);

/// Adds to the input of a job what comes from files. The coincident nodes are null unless they are
/// merged.
using CompleteInput =
    std::function<void(const formats::MeshFile&, const formats::CoincidentNodes*, JobInput&)>;

/// Reads the mesh, has it computed, writes the result. What `complete` refers to must outlive the
/// call.
client::SmoothReport run_job(const JobFlags& flags, SmoothOptions options,
                             const CompleteInput& complete);

/// The mesh file that `flag` names, with the same elements of the same nodes as `input`; it is
/// called `what`. Throws `InvalidMesh` (REFERENCE_DIFFERS) where they differ.
[[nodiscard]] formats::MeshFile read_same_elements(const std::filesystem::path& path,
                                                   const std::string& what, const std::string& flag,
                                                   const JobFlags& flags,
                                                   const formats::MeshFile& input);

}  // namespace meshsmooth::cli
