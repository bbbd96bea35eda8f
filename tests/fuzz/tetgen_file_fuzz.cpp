// The reader and writer of TetGen's pair: the .node file, a line "---", the .ele file.
#include "fuzz/mesh_file.hpp"
#include "fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  static const testing::ScratchFiles files;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  constexpr std::string_view kBetween = "\n---\n";
  const std::size_t between = std::min(bytes.find(kBetween), size);
  const auto path = files.write("given.node", bytes.substr(0, between));
  files.write("given.ele", bytes.substr(std::min(between + kBetween.size(), size)));
  const auto write = [](const std::filesystem::path& target, const formats::MeshFile& file) {
    formats::OutputFiles outputs;
    formats::write_tetgen(target, file, outputs);
    outputs.commit();
  };
  testing::read_and_write(path, files.path("written.node"), formats::read_tetgen, write);
  return 0;
}
