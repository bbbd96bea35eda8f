// The reader and writer of .obj files.
#include "fuzz/mesh_file.hpp"
#include "fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  static const testing::ScratchFiles files;
  const auto path =
      files.write("given.obj", std::string_view(reinterpret_cast<const char*>(data), size));
  testing::read_and_write(path, files.path("written.obj"), formats::read_obj, formats::write_obj);
  return 0;
}
