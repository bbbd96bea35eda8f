#pragma once

#include <memory>

#include "meshsmooth/smoother.hpp"

namespace meshsmooth::detail {

/// Lets a smoother take meshes whose elements are numbered in both directions: where a job finds
/// mirrored ones (`MirroredElements`), it begins anew on a topology in which they are numbered like
/// the others, with the bits of that mesh. Meshes without them go through as they are, at no cost.
[[nodiscard]] std::unique_ptr<Smoother> make_consistent_smoother(std::unique_ptr<Smoother> inner);

}  // namespace meshsmooth::detail
