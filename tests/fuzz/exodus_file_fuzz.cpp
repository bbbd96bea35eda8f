// The reader and writer of Exodus files: netCDF of any kind. The library has bugs of its own.
#include "fuzz/mesh_file.hpp"
#include "fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  static const testing::ScratchFiles files;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  testing::read_and_try_to_write(files.write("given.exo", bytes), files.path("written.exo"));
  return 0;
}
