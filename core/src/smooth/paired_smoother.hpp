#pragma once

#include <memory>

#include "meshsmooth/smoother.hpp"

namespace meshsmooth::detail {

/// A smoother that holds the nodes of `JobInput::node_pairs`: to `inner` they are fixed, so
/// that neither pipeline nor kernels know of pairs. A job with pairs on a prepared topology is
/// computed on the bare one, whose fixed mask is another.
[[nodiscard]] std::unique_ptr<Smoother> make_paired_smoother(std::unique_ptr<Smoother> inner);

}  // namespace meshsmooth::detail
