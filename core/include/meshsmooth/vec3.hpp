#pragma once

#include <cmath>

#include "meshsmooth/annotations.hpp"

namespace meshsmooth {

/// A point or vector in space; `Real` is float or double.
template <class Real>
struct Vec3 {
  Real x, y, z;

  friend MESHSMOOTH_HD constexpr Vec3 operator+(Vec3 a, Vec3 b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend MESHSMOOTH_HD constexpr Vec3 operator-(Vec3 a, Vec3 b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend MESHSMOOTH_HD constexpr Vec3 operator*(Real s, Vec3 a) {
    return {s * a.x, s * a.y, s * a.z};
  }
  MESHSMOOTH_HD constexpr Vec3& operator+=(Vec3 b) { return *this = *this + b; }
  friend MESHSMOOTH_HD constexpr bool operator==(Vec3 a, Vec3 b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
  }
};

using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;

/// Scalar product.
template <class Real>
MESHSMOOTH_HD constexpr Real dot(Vec3<Real> a, Vec3<Real> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// Vector product.
template <class Real>
MESHSMOOTH_HD constexpr Vec3<Real> cross(Vec3<Real> a, Vec3<Real> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Euclidean length.
template <class Real>
MESHSMOOTH_HD Real norm(Vec3<Real> a) {
  return std::sqrt(dot(a, a));
}

/// Converts each coordinate to another precision.
template <class To, class From>
MESHSMOOTH_HD constexpr Vec3<To> vec3_cast(Vec3<From> a) {
  return {static_cast<To>(a.x), static_cast<To>(a.y), static_cast<To>(a.z)};
}

}  // namespace meshsmooth
