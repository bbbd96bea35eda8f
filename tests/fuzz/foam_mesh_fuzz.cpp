// The reader and writer of OpenFOAM's meshes: points, faces, owner, neighbour, boundary and
// cellZones, with lines "---" between them.
#include "fuzz/mesh_file.hpp"
#include "fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  static const testing::ScratchFiles files;
  constexpr std::string_view kBetween = "\n---\n";
  const auto folder = files.path("polyMesh");
  std::filesystem::create_directory(folder);
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  for (const char* name : {"points", "faces", "owner", "neighbour", "boundary", "cellZones"}) {
    const std::size_t between = std::min(rest.find(kBetween), rest.size());
    files.write("polyMesh/" + std::string(name), rest.substr(0, between));
    rest.remove_prefix(std::min(between + kBetween.size(), rest.size()));
  }
  if (std::filesystem::file_size(folder / "cellZones") == 0) {
    std::filesystem::remove(folder / "cellZones");
  }
  const auto written = files.path("written");
  std::filesystem::remove_all(written);
  const auto write = [](const std::filesystem::path& target, const formats::MeshFile& file) {
    formats::OutputFiles outputs;
    formats::write_foam(target, file, outputs);
    outputs.commit();
  };
  testing::read_and_write(folder, written / "polyMesh", formats::read_foam, write);
  return 0;
}
