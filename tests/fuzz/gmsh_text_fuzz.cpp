// What we ourselves read in Gmsh's formats: where the coordinates stand, and how others are
// put there. First byte: which format.
#include <cmath>

#include "fuzz/mesh_file.hpp"
#include "gmsh_fields.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  using testing::require;
  static constexpr const char* kFiles[] = {"a.msh", "a.mesh", "a.unv", "a.inp"};
  testing::Choices choices({data, size});
  const std::filesystem::path path = kFiles[choices.below(std::size(kFiles))];
  const std::string text = choices.rest();
  formats::CoordinateFields found;
  try {
    found = formats::find_coordinates(path, text);
  } catch (const Error&) {
    return 0;
  }
  require(found.positions.size() == found.fields.size() &&
              found.positions.size() == found.node_ids.size(),
          "a place and an id for each node");
  Mesh mesh;
  mesh.positions = found.positions;
  require(formats::replace_coordinates(text, found, mesh.positions_view()) == text,
          "what did not move keeps its very text");
  testing::move_nodes(mesh);
  const std::string moved = formats::replace_coordinates(text, found, mesh.positions_view());
  // In columns a number is rounded; in free fields it is the same again.
  if (found.style != formats::NumberStyle::shortest) return 0;
  const formats::CoordinateFields again = formats::find_coordinates(path, moved);
  require(again.node_ids == found.node_ids, "the same nodes");
  const auto& places = std::get<std::vector<Vec3d>>(mesh.positions);
  for (std::size_t node = 0; node < places.size(); ++node) {
    const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
    require(same(places[node].x, again.positions[node].x) &&
                same(places[node].y, again.positions[node].y) &&
                same(places[node].z, again.positions[node].z),
            "positions survive the way");
  }
  return 0;
}
