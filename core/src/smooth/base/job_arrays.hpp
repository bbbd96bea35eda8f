#pragma once

#include <span>

#include "meshsmooth/options.hpp"

namespace meshsmooth::detail {

/// The caller's arrays of a job, in the type of its result.
template <class Real>
struct JobArrays {
  std::span<const Vec3<Real>> given;
  std::span<Vec3<Real>> result;  // may be the array given
  const JobInput& input;
};

}  // namespace meshsmooth::detail
