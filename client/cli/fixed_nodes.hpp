#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <istream>
#include <string>
#include <vector>

#include "meshsmooth/element.hpp"

namespace meshsmooth::cli {

/// Reads node ids: one 0-based node index a line; empty lines and what follows
/// a '#' are skipped. Throws `InvalidOption` (FIXED_NODES_INVALID) with
/// "name:line: …" for anything else and for ids of `node_count` and above.
[[nodiscard]] std::vector<NodeId> read_fixed_nodes(std::istream& stream, const std::string& name,
                                                   std::size_t node_count);

/// The same from a file. Throws `Error` (FILE_NOT_FOUND) too.
[[nodiscard]] std::vector<NodeId> read_fixed_nodes(const std::filesystem::path& path,
                                                   std::size_t node_count);

/// Marks `nodes` in a mask of one byte a node; an empty mask is made first.
void mark_fixed(std::vector<std::uint8_t>& mask, const std::vector<NodeId>& nodes,
                std::size_t node_count);

}  // namespace meshsmooth::cli
