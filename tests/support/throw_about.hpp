#pragma once

#include "support/oracle.hpp"

namespace meshsmooth::test {

/// Share of the elements whose worst corner is not positive.
inline double inverted_share(const Mesh& mesh) {
  const oracle::Points x = oracle::to_points(mesh);
  double count = 0, inverted = 0;
  for (const oracle::Element& e : oracle::elements(mesh)) {
    ++count;
    if (!(oracle::quality(e.type, oracle::corners(e, x)).mean_ratio > 0)) ++inverted;
  }
  return inverted / count;
}

/// The mesh with its inner nodes thrown about until about `share` of the elements is
/// inverted; plane meshes stay plane.
inline Mesh thrown_about(const Mesh& mesh, double share, unsigned seed) {
  double low = 0, high = 8;
  for (int step = 0; step < 14; ++step) {
    const double middle = 0.5 * (low + high);
    (inverted_share(noisy(mesh, middle, seed)) < share ? low : high) = middle;
  }
  return noisy(mesh, high, seed);
}

}  // namespace meshsmooth::test
