// The reader and writer of SU2's meshes.
#include "fuzz/mesh_file.hpp"
#include "fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  static const testing::ScratchFiles files;
  const auto path = files.write("given.su2", {reinterpret_cast<const char*>(data), size});
  testing::read_and_write(path, files.path("written.su2"), formats::read_su2, formats::write_su2);
  return 0;
}
