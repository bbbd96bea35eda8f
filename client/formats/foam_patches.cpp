#include "foam_patches.hpp"

#include <algorithm>
#include <map>
#include <span>
#include <utility>

#include "meshsmooth/error.hpp"
#include "node_pairs.hpp"

namespace meshsmooth::formats {
namespace {

bool stays(const std::string& patch_type) {
  return patch_type == "empty" || patch_type == "wedge" ||
         patch_type.starts_with("processor");  // also processorCyclic
}

bool is_cyclic(const std::string& patch_type) {
  return !stays(patch_type) && patch_type.find("yclic") != std::string::npos;
}

std::vector<NodeId> nodes_of(const FoamFaces& faces, const FoamEntry& patch) {
  return nodes_of_faces(faces, patch.start_face, patch.face_count);
}

std::vector<NodeId> each_once(std::vector<NodeId> nodes) {
  std::ranges::sort(nodes);
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

void pair_sides(const FoamEntry& patch, const Side& a, const Side& b,
                const std::vector<Vec3d>& positions, FileContent& content) {
  if (a.nodes.empty() && b.nodes.empty()) return;
  auto& pairs = content.node_pairs;
  try {
    const auto found = match_sides(std::span<const Vec3d>(positions), a, b, "neighbourPatch");
    pairs.insert(pairs.end(), found.begin(), found.end());
  } catch (const InvalidOption& error) {
    content.notes.push_back("patch \"" + patch.name + "\" (" + patch.type + "): " + error.what() +
                            "; all of them stay");
    for (const Side& side : {a, b}) {
      for (const NodeId node : side.nodes) pairs.push_back({node, node});
    }
  }
}

void pair_cyclic(const FoamFaces& faces, const std::vector<FoamEntry>& patches,
                 const std::vector<Vec3d>& positions, FileContent& content) {
  for (auto patch = patches.begin(); patch != patches.end(); ++patch) {
    if (!is_cyclic(patch->type)) continue;
    const auto other = std::ranges::find(patches, patch->neighbour, &FoamEntry::name);
    if (other == patches.end() || other == patch) {  // both halves are in one patch
      const std::int64_t half = patch->face_count / 2;
      const auto a = each_once(nodes_of_faces(faces, patch->start_face, half));
      const auto b =
          each_once(nodes_of_faces(faces, patch->start_face + half, patch->face_count - half));
      pair_sides(*patch, {patch->name, a}, {patch->name, b}, positions, content);
    } else if (patch < other || other->neighbour != patch->name) {
      const auto a = each_once(nodes_of(faces, *patch));
      const auto b = each_once(nodes_of(faces, *other));
      pair_sides(*patch, {patch->name, a}, {other->name, b}, positions, content);
    }
  }
}

}  // namespace

std::vector<NodeId> nodes_of_faces(const FoamFaces& faces, std::int64_t first, std::int64_t count) {
  std::vector<NodeId> nodes;
  for (std::int64_t id = first; id < first + count; ++id) {
    const auto face = static_cast<std::size_t>(id);
    for (std::size_t n = 0; n < faces.node_count(face); ++n) {
      nodes.push_back(static_cast<NodeId>(faces.nodes_of(face)[n]));
    }
  }
  return nodes;
}

void add_patch_sets(const FoamFaces& faces, const std::vector<FoamEntry>& patches,
                    FileContent& content) {
  std::map<std::string, NodeSet> groups;
  for (const FoamEntry& patch : patches) {
    const std::vector<NodeId> nodes = nodes_of(faces, patch);
    content.node_sets.push_back({patch.name, nodes});
    for (const std::string& group : patch.groups) {
      if (std::ranges::find(patches, group, &FoamEntry::name) != patches.end()) continue;
      NodeSet& set = groups.try_emplace(group, NodeSet{group, {}}).first->second;
      set.nodes.insert(set.nodes.end(), nodes.begin(), nodes.end());
    }
  }
  for (auto& [name, set] : groups) content.node_sets.push_back(std::move(set));
}

void bind_patches(const FoamFaces& faces, const std::vector<FoamEntry>& patches,
                  const std::vector<Vec3d>& positions, FileContent& content) {
  for (const FoamEntry& patch : patches) {
    if (!stays(patch.type)) continue;
    const std::vector<NodeId> nodes = nodes_of(faces, patch);
    content.fixed_nodes.insert(content.fixed_nodes.end(), nodes.begin(), nodes.end());
  }
  pair_cyclic(faces, patches, positions, content);
}

}  // namespace meshsmooth::formats
