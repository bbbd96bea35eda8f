#pragma once

#include <memory>

#include "meshsmooth/smoother.hpp"

namespace meshsmooth::detail {

/// Lets a smoother take meshes that are not canonical (see canonical_topology.hpp): where a job
/// finds that (`NotCanonical`), it starts anew on the canonical topology, with the bits of that
/// mesh. Others pass through as they are, at no cost.
[[nodiscard]] std::unique_ptr<Smoother> make_canonical_smoother(std::unique_ptr<Smoother> inner);

}  // namespace meshsmooth::detail
