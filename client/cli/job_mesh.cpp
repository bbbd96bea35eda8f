#include "job_mesh.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fixed_nodes.hpp"
#include "node_pairs.hpp"
#include "node_sets.hpp"

namespace meshsmooth::cli {
namespace {

/// Marks the nodes of lower-dimensional cells and of sets' sides; where the boundary may move,
/// those inside the mesh, which it returns: the others follow the boundary's nodes. Prescribed ones
/// move.
formats::InnerCells fix_lower_dimensional(formats::MeshFile& file,
                                          const PrescribedNodes& prescribed_nodes,
                                          BoundaryPolicy boundary) {
  const bool fixed = boundary == BoundaryPolicy::fixed;
  formats::InnerCells inner;
  if (!fixed || formats::names_facets(file)) inner = formats::find_inner_cells(file);
  std::vector<NodeId> nodes = inner.nodes;
  if (fixed) {
    const std::vector<NodeId>& of_cells = file.lower_dimensional_nodes();
    nodes.insert(nodes.end(), of_cells.begin(), of_cells.end());
  }
  std::vector<NodeId> prescribed(prescribed_nodes.nodes.begin(), prescribed_nodes.nodes.end());
  std::ranges::sort(prescribed);
  std::erase_if(nodes, [&](NodeId node) { return std::ranges::binary_search(prescribed, node); });
  mark_fixed(file.mesh.fixed, nodes, file.mesh.node_count());
  return inner;
}

/// Gives the mesh its regions; with a free boundary they would fix nothing.
formats::Regions set_regions(formats::MeshFile& file, const JobFlags& flags,
                             BoundaryPolicy boundary) {
  const bool automatic = flags.regions == "auto";
  if (flags.regions == "none" || (automatic && boundary == BoundaryPolicy::free)) return {};
  if (boundary == BoundaryPolicy::free) {
    throw InvalidOption("OPTION_MISPLACED",
                        "--regions " + flags.regions +
                            " means nothing with --boundary free, which frees interfaces too",
                        {{"field", "--regions"}});
  }
  formats::Regions regions =
      automatic ? formats::find_regions(file) : formats::find_regions(file, flags.regions);
  file.mesh.regions = std::move(regions.of_element);
  return regions;
}

}  // namespace

void fix_named_nodes(formats::MeshFile& file, const JobFlags& flags) {
  const std::size_t node_count = file.mesh.node_count();
  if (flags.fixed_nodes) {
    mark_fixed(file.mesh.fixed, read_fixed_nodes(*flags.fixed_nodes, node_count), node_count);
  }
  for (const std::string& name : flags.fixed_sets) {
    mark_fixed(file.mesh.fixed, formats::find_node_set(file, name), node_count);
  }
  for (const ElementBlock& block : file.mesh.blocks) {
    const std::string_view type = element_name(block.type);
    if (std::ranges::find(flags.fixed_types, type) == flags.fixed_types.end()) continue;
    mark_fixed(file.mesh.fixed, block.nodes, node_count);
  }
}

std::vector<NodePair> find_node_pairs(const formats::MeshFile& file, const JobFlags& flags) {
  std::vector<NodePair> pairs;
  if (flags.file_pairs == "on") pairs = file.node_pairs();
  for (const auto& [name_a, name_b] : flags.periodic) {
    const std::vector<NodeId> a = formats::find_node_set(file, name_a);
    const std::vector<NodeId> b = formats::find_node_set(file, name_b);
    const auto found =
        formats::match_sides(file.mesh.positions_view(), {name_a, a}, {name_b, b}, "--periodic");
    pairs.insert(pairs.end(), found.begin(), found.end());
  }
  return pairs;
}

MeshParts set_up_mesh(formats::MeshFile& file, const JobFlags& flags, const JobInput& input,
                      BoundaryPolicy boundary) {
  formats::Regions regions = set_regions(file, flags, boundary);
  return {std::move(regions), fix_lower_dimensional(file, input.prescribed, boundary)};
}

}  // namespace meshsmooth::cli
