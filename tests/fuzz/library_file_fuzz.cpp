// The formats that VTK and Gmsh read, as a user reads them. First byte: which. The libraries
// have bugs of their own: docs/reliability.md says which are known.
#include "fuzz/mesh_file.hpp"
#include "fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  static constexpr const char* kNames[] = {"a.vtu", "a.vtk", "a.vtp", "a.stl",
                                           "a.msh", "a.unv", "a.mesh"};
  static const testing::ScratchFiles files;
  testing::Choices choices({data, size});
  const auto path = files.write(kNames[choices.below(std::size(kNames))], choices.rest());
  try {
    const formats::MeshFile file = formats::read_mesh_file(path);
    testing::check_mesh(file);
    testing::ask_for_names(file);
  } catch (const Error& error) {
    testing::require(std::string(error.what()).starts_with(path.string()),
                     "an error says which file");
  }
  return 0;
}
