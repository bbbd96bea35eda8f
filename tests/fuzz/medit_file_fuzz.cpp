// The reader and writer of Medit's meshes, of text and binary.
#include <algorithm>

#include "fuzz/mesh_file.hpp"
#include "fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  static const testing::ScratchFiles files;
  const auto path = files.write("given.mesh", {reinterpret_cast<const char*>(data), size});
  // The order of nodes in prisms and elements of second order follows from where the nodes are,
  // so these are not moved as wildly as here.
  const auto by_positions = [](const ElementBlock& block) {
    return is_second_order(block.type) || block.type == ElementType::wedge;
  };
  try {
    const formats::MeshFile file = formats::read_medit(path);
    testing::check_mesh(file);
    testing::ask_for_names(file);
    if (std::ranges::any_of(file.mesh.blocks, by_positions)) return 0;
  } catch (const Error&) {
  }
  testing::read_and_write(path, files.path("written.mesh"), formats::read_medit,
                          formats::write_medit);
  return 0;
}
