#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "coordinate_fields.hpp"
#include "msh/element_types.hpp"
#include "msh/numbers.hpp"

namespace meshsmooth::formats {

/// One element; its node tags start at `first`.
struct MshElement {
  std::int64_t tag;
  const MshElementType* type;
  std::size_t first;
  std::int32_t node_count;
  std::int32_t entity;
  std::int32_t physical;   // before version 3, without its sign; 0: none
  std::int32_t dimension;  // of the entity
};

/// The values of one data section, by the tags of nodes or elements.
struct MshView {
  bool on_nodes;
  std::string name;
  int step;
  std::size_t components;
  std::vector<std::int64_t> tags;
  std::vector<double> values;
};

using MshEntity = std::pair<int, int>;  // dimension, tag; also of physical groups

/// What is read of an MSH file. Everything else stays in its bytes.
struct MshContent {
  MshFormat format;
  CoordinateFields nodes;
  std::vector<MshElement> elements;
  std::vector<std::int64_t> node_tags;              // of the elements
  std::map<MshEntity, std::vector<int>> physicals;  // of an entity, since version 3, no signs
  std::map<MshEntity, std::string> physical_names;  // by group; dimension -1: of any
  std::vector<MshView> views;                       // the first step of each
  std::vector<std::array<std::int64_t, 2>> periodic_nodes;  // tags
};

// Each reads a section after its name and leaves its end to the caller.

/// $Nodes, $NOD, $ParametricNodes.
void read_msh_nodes(const std::filesystem::path& path, MshNumbers& numbers, bool parametric,
                    CoordinateFields& found);
/// $Elements, $ELM.
void read_msh_elements(const std::filesystem::path& path, MshNumbers& numbers, MshContent& content);
/// $Entities and $PartitionedEntities, since version 3.
void read_msh_entities(MshNumbers& numbers, bool partitioned, MshContent& content);
/// $PhysicalNames.
void read_msh_names(MshNumbers& numbers, MshContent& content);
/// $Periodic.
void read_msh_periodic(MshNumbers& numbers, MshContent& content);
/// $NodeData, $ElementData.
void read_msh_view(MshNumbers& numbers, bool on_nodes, MshContent& content);

/// The whole file. Throws FORMAT_ERROR, FILE_TRUNCATED, MESH_EMPTY, ELEMENT_NOT_SUPPORTED. O(file).
[[nodiscard]] MshContent parse_msh(const std::filesystem::path& path, std::string_view text);

/// Where its coordinates stand. O(file).
[[nodiscard]] CoordinateFields find_msh_coordinates(const std::filesystem::path& path,
                                                    std::string_view text);

}  // namespace meshsmooth::formats
