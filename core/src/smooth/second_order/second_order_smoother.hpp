#pragma once

#include <memory>

#include "meshsmooth/smoother.hpp"

namespace meshsmooth::detail {

/// Lets a smoother of linear meshes take those of second order: it smooths the mesh of the corners,
/// with the same bits as that one alone; the nodes in the middle of edges, faces and elements
/// follow (`MidNodes`), on as many threads (0: all). Linear meshes go through as they are.
[[nodiscard]] std::unique_ptr<Smoother> make_second_order_smoother(std::unique_ptr<Smoother> linear,
                                                                   int thread_count);

}  // namespace meshsmooth::detail
