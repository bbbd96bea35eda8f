#include "mesh.hpp"

#include <cstddef>
#include <cstring>
#include <limits>
#include <span>
#include <variant>
#include <vector>

#include "error.hpp"
#include "structures.hpp"

namespace meshsmooth::c {
namespace {

static_assert(MESHSMOOTH_TRIANGLE == static_cast<int>(ElementType::triangle) + 1);
static_assert(MESHSMOOTH_HEXAHEDRON27 == static_cast<int>(ElementType::hexahedron27) + 1);
static_assert(MESHSMOOTH_HEXAHEDRON27 == kElementTypeCount);

template <class Value>
std::vector<Value> copy_of(std::span<const Value> array) {
  return {array.begin(), array.end()};
}

ElementBlock read_block(const meshsmooth_block& given, std::size_t index) {
  const std::string field = "meshsmooth_mesh.blocks[" + std::to_string(index) + "]";
  if (given.type < 1 || given.type > std::int64_t{kElementTypeCount}) {
    throw invalid_argument(field + ".type", "is " + std::to_string(given.type) +
                                                ", it must be MESHSMOOTH_TETRAHEDRON or another "
                                                "of meshsmooth_element");
  }
  const auto type = static_cast<ElementType>(given.type - 1);
  const auto width = static_cast<std::int64_t>(element_width(type));
  if (given.element_count < 0 ||
      given.element_count > std::numeric_limits<std::int64_t>::max() / width) {
    throw invalid_argument(field + ".element_count", "is " + std::to_string(given.element_count));
  }
  return {type,
          copy_of(array_of<NodeId>(given.nodes, given.element_count * width, field + ".nodes"))};
}

}  // namespace

PositionsView view_like(bool float32, const void* array, std::int64_t count,
                        const std::string& field) {
  if (float32) return array_of<Vec3f>(array, count, field);
  return array_of<Vec3d>(array, count, field);
}

ReadMesh read_mesh(const meshsmooth_mesh* given) {
  const meshsmooth_mesh in = read_structure(given, "mesh");
  ReadMesh read;
  if (in.scalar == MESHSMOOTH_FLOAT32) {
    read.mesh.positions =
        copy_of(array_of<Vec3f>(in.positions, in.node_count, "meshsmooth_mesh.positions"));
  } else if (in.scalar == MESHSMOOTH_FLOAT64) {
    read.mesh.positions =
        copy_of(array_of<Vec3d>(in.positions, in.node_count, "meshsmooth_mesh.positions"));
  } else {
    throw invalid_argument("meshsmooth_mesh.scalar",
                           "is " + std::to_string(in.scalar) +
                               ", it must be MESHSMOOTH_FLOAT32 or MESHSMOOTH_FLOAT64");
  }
  const auto blocks =
      array_of<meshsmooth_block>(in.blocks, in.block_count, "meshsmooth_mesh.blocks");
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    read.mesh.blocks.push_back(read_block(blocks[i], i));
  }
  if (in.fixed != nullptr) {
    read.mesh.fixed = copy_of(std::span(in.fixed, read.mesh.node_count()));
  }
  if (in.regions != nullptr) {
    read.mesh.regions = copy_of(std::span(in.regions, read.mesh.element_count()));
  }
  if (in.reference != nullptr) {
    read.input.reference = view_like(in.scalar == MESHSMOOTH_FLOAT32, in.reference, in.node_count,
                                     "meshsmooth_mesh.reference");
  }
  read.input.node_pairs = array_of<NodePair>(in.pairs, in.pair_count, "meshsmooth_mesh.pairs");
  return read;
}

void write_positions(const PositionsView& positions, void* result) {
  std::visit(
      [result](const auto& array) {
        if (!array.empty()) std::memcpy(result, array.data(), array.size_bytes());
      },
      positions);
}

}  // namespace meshsmooth::c
