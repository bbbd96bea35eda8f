#include "generate/tangle.hpp"

#include <cmath>
#include <string>

#include "generate/random.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth::formats {
namespace {

double inverted_share(const Mesh& mesh) {
  const QualityStats quality = measure_quality(mesh);
  return static_cast<double>(quality.inverted_count) / static_cast<double>(quality.element_count);
}

}  // namespace

void check_tangle(double share) {
  if (!(share >= 0 && share <= 0.45)) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "tangle " + std::to_string(share) + " is not in [0, 0.45]",
                        {{"field", "tangle"}});
  }
}

void tangle(Mesh& mesh, const std::vector<std::uint8_t>& movable, double share,
            std::uint64_t seed) {
  check_tangle(share);
  if (share == 0) return;
  const bool plane = element_shape(mesh.blocks.front().type).dimension == 2;
  auto& nodes = std::get<std::vector<Vec3d>>(mesh.positions);
  const std::vector<Vec3d> start = nodes;
  std::vector<Vec3d> throws(nodes.size());
  Random random(seed ^ 0x74616e676c65ULL);
  for (Vec3d& each : throws) {
    each = random.vector(1.0);
    if (plane) each.z = 0;
  }
  const auto apply = [&](double size) {
    for (std::size_t node = 0; node < nodes.size(); ++node) {
      if (movable[node] != 0) nodes[node] = start[node] + size * throws[node];
    }
  };

  double lower = 0;
  double upper = 1.0 / std::pow(static_cast<double>(nodes.size()), plane ? 0.5 : 1.0 / 3.0);
  constexpr int kDoublings = 8;
  for (int step = 0; step < kDoublings; ++step) {
    apply(upper);
    if (inverted_share(mesh) >= share) break;
    lower = upper;
    upper *= 2;
  }
  constexpr int kHalvings = 12;
  for (int step = 0; step < kHalvings; ++step) {
    const double middle = 0.5 * (lower + upper);
    apply(middle);
    (inverted_share(mesh) < share ? lower : upper) = middle;
  }
  apply(upper);
}

}  // namespace meshsmooth::formats
