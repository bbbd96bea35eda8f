// Names of topologies: the same however the bytes come, another for every other content.
#include <array>
#include <vector>

#include "fuzz/choices.hpp"
#include "meshsmooth/mesh.hpp"
#include "wire/mesh_layout.hpp"
#include "wire/topology_name.hpp"

namespace {

using namespace meshsmooth;
using meshsmooth::testing::Choices;
using meshsmooth::testing::require;

Mesh make_mesh(Choices& choices) {
  Mesh mesh;
  mesh.positions = std::vector<Vec3d>(choices.below(40));
  for (std::size_t left = choices.below(4); left > 0; --left) {
    const ElementType type = kElementTypes[choices.below(kElementTypeCount)];
    const auto corners = element_width(type);
    ElementBlock& block = mesh.blocks.emplace_back(ElementBlock{type, {}});
    for (std::size_t node = choices.below(5) * corners; node > 0; --node) {
      block.nodes.push_back(static_cast<NodeId>(choices.number()));
    }
  }
  if (choices.flag()) {
    for (std::size_t i = 0; i < mesh.node_count(); ++i) mesh.fixed.push_back(choices.byte());
  }
  if (choices.flag()) {
    for (std::size_t i = 0; i < mesh.element_count(); ++i) {
      mesh.regions.push_back(static_cast<std::int32_t>(choices.number()));
    }
  }
  return mesh;
}

bool same(const Mesh& a, const Mesh& b) {
  return a.node_count() == b.node_count() && a.fixed == b.fixed && a.regions == b.regions &&
         std::ranges::equal(a.blocks, b.blocks, [](const auto& x, const auto& y) {
           return x.type == y.type && x.nodes == y.nodes;
         });
}

/// In pieces of any size, as chunks bring it.
std::string name_in_pieces(const Mesh& mesh, Choices& choices) {
  const MeshTopology topology(mesh);
  wire::MeshLayout layout;
  layout.node_count = static_cast<std::int64_t>(mesh.node_count());
  layout.fixed_mask_bytes = static_cast<std::int64_t>(mesh.fixed.size());
  layout.element_regions_bytes =
      static_cast<std::int64_t>(mesh.regions.size() * sizeof(std::int32_t));
  std::vector<std::byte> bytes;
  const auto append = [&](std::span<const std::byte> more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
  };
  for (const ElementBlockView& block : topology.view().blocks) {
    layout.blocks.push_back({block.type, static_cast<std::int64_t>(block.element_count())});
    append(std::as_bytes(block.nodes));
  }
  append(std::as_bytes(std::span(mesh.fixed)));
  append(std::as_bytes(std::span(mesh.regions)));
  wire::TopologyNamer namer(layout);
  for (std::span<const std::byte> rest = bytes; !rest.empty();) {
    const std::size_t size =
        choices.empty() ? rest.size() : std::min<std::size_t>(choices.byte(), rest.size());
    namer.add(rest.first(size));
    rest = rest.subspan(size);
  }
  return namer.finish();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Choices choices({data, size});
  const Mesh one = make_mesh(choices);
  const Mesh other = make_mesh(choices);
  const std::string name = wire::topology_name(MeshTopology(one).view());
  constexpr std::string_view kPrefix = "topologies/sha256-";
  require(name.starts_with(kPrefix) && name.size() == kPrefix.size() + 64 &&
              name.find_first_not_of("0123456789abcdef", kPrefix.size()) == std::string::npos,
          "a name is sha256 and 64 digits");
  require((name == wire::topology_name(MeshTopology(other).view())) == same(one, other),
          "one name for one content");
  require(name == name_in_pieces(one, choices), "the name by pieces is that of the whole");
  return 0;
}
