#include "plane.hpp"

#include <string>

#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {

void check_plane(const std::filesystem::path& file, const Mesh& mesh) {
  const auto check = [&](const auto& positions) {
    for (std::size_t node = 0; node < positions.size(); ++node) {
      if (positions[node].z == 0) continue;
      fail("FORMAT_ERROR", file,
           "node " + std::to_string(node) + " is not in the plane z = 0, where a " +
               extension_of(file) + " file in two dimensions lies");
    }
  };
  std::visit(check, mesh.positions);
}

}  // namespace meshsmooth::formats
