#pragma once

#include <cstdint>
#include <cstring>

#include "meshsmooth/annotations.hpp"

// Cube roots that host and device round equally, and of which compilers make vectors.

namespace meshsmooth::detail {

/// x^(-1/3) for a positive, normal x, to about two units in the last place, by
/// operations that host and device round equally: an estimate from the exponent, then two
/// iterations of fourth order.
MESHSMOOTH_HD inline double inverse_cbrt(double x) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  const std::uint64_t third = ((bits >> 32) * 0x55555556U) >> 32;
  bits = (std::uint64_t{0x553ef0ff} - third) << 32;
  double y = 0;
  std::memcpy(&y, &bits, sizeof y);
  for (int step = 0; step < 2; ++step) {
    const double h = 1 - (x * y) * (y * y);
    y += y * h * (1.0 / 3 + h * (2.0 / 9 + h * (14.0 / 81)));
  }
  return y;
}

/// The cube root of 0 or of a positive, normal x below 1e300, to one unit in the last place (of
/// glibc's it is three); exact where x is the cube of a power of two,
/// and at most 1 up to 1.
MESHSMOOTH_HD inline double cube_root(double x) {
  const double y = inverse_cbrt(x);
  const double root = x * (y * y);
  // A step of Newton's method, whose residual is nearly exact.
  const double better = root - (root * root * root - x) * (y * y) * (1.0 / 3);
  return x > 0 ? better : 0;
}

}  // namespace meshsmooth::detail
