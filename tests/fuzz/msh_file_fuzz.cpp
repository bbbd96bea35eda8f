// The reader and writer of Gmsh's MSH files, of all versions, in text and binary.
#include "fuzz/mesh_file.hpp"
#include "fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  static const testing::ScratchFiles files;
  const auto path = files.write("given.msh", {reinterpret_cast<const char*>(data), size});
  testing::read_and_write(path, files.path("written.msh"), formats::read_msh, formats::write_msh);
  return 0;
}
