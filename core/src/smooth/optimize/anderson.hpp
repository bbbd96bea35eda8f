#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "smooth/base/mesh_counts.hpp"
#include "smooth/base/positions.hpp"
#include "smooth/optimize/optimize_sweeper.hpp"

namespace meshsmooth::detail {

/// How many earlier sweeps an extrapolation uses.
inline constexpr int kAndersonWindow = 4;
/// How many sweeps are kept, the last one included.
inline constexpr int kKeptSweeps = kAndersonWindow + 1;

/// Bytes of `AndersonMixing`.
[[nodiscard]] inline std::int64_t anderson_bytes(const MeshCounts& mesh) {
  return mesh.nodes * kKeptSweeps * (mesh.position_bytes + std::int64_t{sizeof(Vec3f)});
}

/// The scalar products of one vector with each of the kept ones.
struct KeptProducts {
  double with[kKeptSweeps] = {};

  friend MESHSMOOTH_HD KeptProducts operator+(const KeptProducts& a, const KeptProducts& b) {
    KeptProducts sum;
    for (int k = 0; k < kKeptSweeps; ++k) sum.with[k] = a.with[k] + b.with[k];
    return sum;
  }
};

/// An array per kept sweep.
template <class T>
struct KeptArrays {
  T* of[kKeptSweeps];
};

template <class T, class Buffers>
[[nodiscard]] KeptArrays<T> arrays_of(Buffers& buffers) {
  KeptArrays<T> result{};
  for (int k = 0; k < kKeptSweeps; ++k) result.of[k] = buffers[k].data();
  return result;
}

/// The minimizer t of the squared length of v - sum of t_j (v - v_j), from the scalar products of
/// all of them, by Cholesky's method; `own` is the index of v, whose own factor is 0. Nothing where
/// the differences depend on each other to rounding.
using Factors = std::array<double, kKeptSweeps>;
[[nodiscard]] inline std::optional<Factors> least_squares(
    const std::array<Factors, kKeptSweeps>& products, int count, int own) {
  // As the factors of v itself are free, its row and column become those of the unit matrix.
  std::array<Factors, kKeptSweeps> a{};
  Factors b{};
  double largest = 0;
  const auto& p = products;
  for (int i = 0; i < count; ++i) {
    b[i] = p[own][own] - p[own][i];
    for (int j = 0; j < count; ++j) a[i][j] = p[own][own] - p[own][i] - p[own][j] + p[i][j];
    largest = std::max(largest, a[i][i]);
  }
  for (int i = 0; i < count; ++i) a[i][i] += 1e-9 * largest;
  a[own][own] = largest;
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j <= i; ++j) {
      double rest = a[i][j];
      for (int k = 0; k < j; ++k) rest -= a[i][k] * a[j][k];
      if (i == j && !(rest > 0)) return std::nullopt;
      a[i][j] = i == j ? std::sqrt(rest) : rest / a[j][j];
    }
  }
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (int i = count - 1; i >= 0; --i) {
    for (int k = i + 1; k < count; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
  return b;
}

/// Anderson acceleration of whole sweeps x -> G(x) of a valid mesh: from G and the residuals
/// G(x) - x of the last sweeps it extrapolates to where the residual would be least. The result is
/// taken only where every element is certainly valid and the energy below that after the plain
/// sweep, so no promise of the sweeps is touched.
///
/// Source: Peng et al. 2018, "Anderson acceleration for geometry optimization and physics
/// simulation", section 3.
/// cost   a pass over the nodes and two over the elements per sweep; `anderson_bytes`
/// order  deterministic
template <Executor E, class Real>
class AndersonMixing {
 public:
  AndersonMixing(E& executor, OptimizeSweeper<E, Real>& sweeper, int power)
      : executor_(executor), sweeper_(sweeper), power_(power), energy_(sweeper.measure(power)) {
    for (int k = 0; k < kKeptSweeps; ++k) {
      ends_[k] = executor.template allocate<Vec3<Real>>(node_count());
      residuals_[k] = executor.template allocate<Vec3f>(node_count());
    }
  }

  /// Before a sweep.
  void begin() {
    copy_positions(executor_, node_count(), sweeper_.positions(), ends_[own()].data());
  }

  /// After a sweep. Returns by how much further than by the sweep alone the energy fell, >= 1.
  double extrapolate() {
    keep();
    const MeshEnergy before = energy_;
    const MeshEnergy plain = energy_ = sweeper_.measure(power_);
    const int last = own();
    const int count = std::min(++sweeps_, kKeptSweeps);
    if (count < 2 || plain.invalid > 0) return 1;
    const std::optional<Factors> factors = least_squares(products_, count, last);
    if (!factors) return 1;
    mix(*factors, count, last);
    const MeshEnergy mixed = sweeper_.measure(power_);
    if (mixed.invalid > 0 || !(mixed.energy < plain.energy) ||
        turns_facets(executor_, sweeper_.around().sliding, ends_[last].data(),
                     sweeper_.positions())) {
      copy_positions(executor_, node_count(), ends_[last].data(), sweeper_.positions());
      return 1;
    }
    sweeper_.wake_all();
    energy_ = mixed;
    const double fall = before.energy - plain.energy;
    return fall > 0 ? (before.energy - mixed.energy) / fall : 1;
  }

  // Public, as functors for device code must not be made in private members.

  [[nodiscard]] std::size_t node_count() const { return sweeper_.around().node_count; }
  [[nodiscard]] int own() const { return sweeps_ % kKeptSweeps; }

  /// Stores the sweep's end, its residual and its scalar products.
  void keep() {
    const int last = own();
    const int count = std::min(sweeps_ + 1, kKeptSweeps);
    Vec3<Real>* const end = ends_[last].data();  // the sweep's start until now
    Vec3f* const residual = residuals_[last].data();
    const Vec3<Real>* const x = sweeper_.positions();
    const auto kept = arrays_of<Vec3f>(residuals_);
    const KeptProducts products = executor_.reduce(
        node_count(), KeptProducts{},
        [=] MESHSMOOTH_HD(std::size_t node) {
          const Vec3f r = vec3_cast<float>(x[node] - end[node]);
          residual[node] = r;
          end[node] = x[node];
          KeptProducts own;
          for (int k = 0; k < count; ++k) {
            const Vec3f other = k == last ? r : kept.of[k][node];
            own.with[k] = dot(vec3_cast<double>(r), vec3_cast<double>(other));
          }
          return own;
        },
        Plus{});
    for (int k = 0; k < count; ++k) products_[last][k] = products_[k][last] = products.with[k];
  }

  /// Moves the free nodes to the extrapolated positions.
  void mix(const Factors& factors, int count, int last) {
    const Surroundings around = sweeper_.around();
    const DisplacementLimit<Real> limit = sweeper_.displacement_limit();
    const auto ends = arrays_of<Vec3<Real>>(ends_);
    KeptProducts by;  // a plain array, for device code
    std::copy(factors.begin(), factors.end(), by.with);
    Vec3<Real>* const x = sweeper_.positions();
    executor_.for_each(node_count(), [=] MESHSMOOTH_HD(std::size_t node) {
      if (around.fixed[node] != 0) return;
      const Vec3d end = vec3_cast<double>(ends.of[last][node]);
      Vec3d step{0, 0, 0};
      for (int k = 0; k < count; ++k) {
        if (k != last) step += by.with[k] * (vec3_cast<double>(ends.of[k][node]) - end);
      }
      if (step == Vec3d{0, 0, 0}) return;
      x[node] = project(around, limit, node, vec3_cast<Real>(end + step));
    });
  }

 private:
  E& executor_;
  OptimizeSweeper<E, Real>& sweeper_;
  int power_;
  MeshEnergy energy_;
  int sweeps_ = 0;
  std::array<typename E::template Buffer<Vec3<Real>>, kKeptSweeps> ends_;
  std::array<typename E::template Buffer<Vec3f>, kKeptSweeps> residuals_;
  std::array<Factors, kKeptSweeps> products_{};
};

}  // namespace meshsmooth::detail
