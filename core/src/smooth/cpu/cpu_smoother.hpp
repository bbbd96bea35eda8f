#pragma once

#include <memory>

#include "meshsmooth/smoother.hpp"

namespace meshsmooth::detail {

/// The CPU backend. `thread_count` 0 means all cores.
[[nodiscard]] std::unique_ptr<Smoother> make_cpu_smoother(int thread_count);

}  // namespace meshsmooth::detail
