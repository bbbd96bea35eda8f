#pragma once

#include <cstdint>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::detail {

/// All that a visit must know before it can ask for positions.
struct alignas(16) BallRecord {
  std::int64_t begin;  // of its entries in the balls
  NodeId node;
  std::int32_t size;
};

}  // namespace meshsmooth::detail
