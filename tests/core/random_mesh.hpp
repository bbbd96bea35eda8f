#pragma once

// Meshes that nobody has thought of. How many: MESHSMOOTH_RANDOM_MESHES, 1000 by default.

#include <cstdlib>
#include <random>

#include "core/smoothing.hpp"

namespace meshsmooth::test {

inline int mesh_count() {
  const char* const wish = std::getenv("MESHSMOOTH_RANDOM_MESHES");
  return wish == nullptr ? 1000 : std::atoi(wish);
}

inline bool is_valid(const Mesh& mesh) {
  const QualityStats quality = measure_quality(mesh);
  return quality.inverted_count == 0 && quality.degenerate_count == 0;
}

/// A lattice, or all volume types together, sheared, stretched, thrown about, some of its
/// nodes fixed, its elements of several regions.
class RandomMesh {
 public:
  explicit RandomMesh(unsigned seed) : random_(seed), seed_(seed) {
    const int kind = pick(0, static_cast<int>(kLinearTypeCount));
    const bool mixed = kind == static_cast<int>(kLinearTypeCount);
    lattice_ =
        mixed ? mixed_stack(pick(2, 3)) : lattice(static_cast<ElementType>(kind), pick(2, 4));
    if (pick(0, 1) == 1) {
      for (std::size_t n = 0; n < lattice_.node_count(); ++n) {
        lattice_.fixed.push_back(pick(0, 3) == 0 ? 1 : 0);
      }
    }
    if (pick(0, 2) == 0) {
      const int run = pick(1, 40);
      for (std::size_t e = 0; e < lattice_.element_count(); ++e) {
        lattice_.regions.push_back(static_cast<int>(e) / run % 3);
      }
    }
    const bool surface = !mixed && oracle::is_surface(static_cast<ElementType>(kind));
    for (double& s : stretch_) s = std::exp(uniform(-1.5, 1.5));
    for (double& s : shear_) s = uniform(-0.7, 0.7);
    if (surface) shear_[1] = shear_[2] = 0;
  }

  /// Thrown about by as much as leaves it valid.
  [[nodiscard]] Mesh valid() {
    for (double size = uniform(0.05, 0.6);; size *= 0.7) {
      Mesh mesh = thrown(size);
      if (is_valid(mesh)) return mesh;
    }
  }
  [[nodiscard]] Mesh thrown(double size) const {
    return mapped(noisy(lattice_, size, seed_), [this](Vec3d p) {
      return Vec3d{stretch_[0] * (p.x + shear_[0] * p.y + shear_[1] * p.z),
                   stretch_[1] * (p.y + shear_[2] * p.z), stretch_[2] * p.z};
    });
  }
  [[nodiscard]] int pick(int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random_);
  }
  [[nodiscard]] double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

 private:
  std::mt19937_64 random_;
  unsigned seed_;
  Mesh lattice_;
  double stretch_[3];
  double shear_[3];
};

/// Curved along two waves of random size and length.
inline Mesh waved(Mesh mesh, RandomMesh& random) {
  Vec3d low = points(mesh).front(), high = low;
  for (const Vec3d& p : points(mesh)) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const double size = norm(high - low);
  const double along = random.uniform(1, 4) / size, across = random.uniform(1, 4) / size;
  const double rise = random.uniform(0, 0.3) / along, sway = random.uniform(0, 0.3) / across;
  return mapped(std::move(mesh), [&](Vec3d p) {
    p.y += sway * std::sin(across * p.x);
    if (low.z < high.z) p.z += rise * std::sin(along * (p.x + p.y));
    return p;
  });
}

}  // namespace meshsmooth::test
