// The readers and writers of MED, CGNS and XDMF. First byte: which; an XDMF file is the text, a
// line "---", the .h5 file. HDF5 has bugs of its own.
#include "fuzz/mesh_file.hpp"
#include "fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  static constexpr const char* kExtensions[] = {".med", ".cgns", ".xdmf"};
  static const testing::ScratchFiles files;
  testing::Choices choices({data, size});
  const std::string extension = kExtensions[choices.below(std::size(kExtensions))];
  const std::string rest = choices.rest();
  const std::string_view bytes = rest;
  constexpr std::string_view kBetween = "\n---\n";
  const std::size_t between = extension == ".xdmf" ? bytes.find(kBetween) : bytes.npos;
  files.write("given.h5", between == bytes.npos ? "" : bytes.substr(between + kBetween.size()));
  testing::read_and_try_to_write(files.write("given" + extension, bytes.substr(0, between)),
                                 files.path("written" + extension));
  return 0;
}
