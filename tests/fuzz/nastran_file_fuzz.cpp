// The reader and writer of Nastran decks: the deck, a line "---", a file "part.dat" for it to
// include.
#include "fuzz/mesh_file.hpp"
#include "fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  static const testing::ScratchFiles files;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  constexpr std::string_view kBetween = "\n---\n";
  const std::size_t between = std::min(bytes.find(kBetween), size);
  const auto path = files.write("given.bdf", bytes.substr(0, between));
  files.write("part.dat", bytes.substr(std::min(between + kBetween.size(), size)));
  const auto write = [](const std::filesystem::path& target, formats::MeshFile file) {
    // Nodes that define coordinate systems are fixed; moved into a line they would define none.
    if (!file.mesh.fixed.empty()) file.mesh.positions = file.content()->dataset->positions();
    formats::OutputFiles outputs;
    formats::write_nastran(target, file, outputs);
    outputs.commit();
  };
  testing::read_and_write(path, files.path("written.bdf"), formats::read_nastran, write);
  return 0;
}
