#include "mesh/cube_root.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace meshsmooth::detail {
namespace {

TEST(InverseCbrt, IsExactToTheLastDigits) {
  for (double x = 1e-250; x < 1e250; x *= 1.37) {
    EXPECT_NEAR(inverse_cbrt(x) * std::cbrt(x), 1, 1e-15) << x;
  }
}

TEST(CubeRoot, IsWithinAUnitInTheLastPlace) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(-200, 200);
  for (int n = 0; n < 100'000; ++n) {
    const double x = std::exp2(exponent(random));
    const double root = cube_root(x);
    const long double exact = std::cbrt(static_cast<long double>(x));
    const double unit = std::nextafter(root, std::numeric_limits<double>::infinity()) - root;
    ASSERT_LE(std::abs(static_cast<double>(root - exact)), unit) << x;
  }
}

TEST(CubeRoot, IsExactOfPowersOfEightAndOfZero) {
  EXPECT_EQ(cube_root(0), 0);
  for (int power = -90; power <= 90; ++power) {
    EXPECT_EQ(cube_root(std::ldexp(1, 3 * power)), std::ldexp(1, power)) << power;
  }
}

TEST(CubeRoot, OfARatioBelowOneIsAtMostOne) {
  double x = 1;
  for (int n = 0; n < 1000; ++n) {
    EXPECT_LE(cube_root(x), 1) << x;
    x = std::nextafter(x, 0.0);
  }
}

}  // namespace
}  // namespace meshsmooth::detail
