#pragma once

#include <string_view>

#include "meshsmooth/backend_name.hpp"

namespace meshsmooth::detail {

/// N of "cuda:N", 0 of "cuda", else -1.
[[nodiscard]] inline int cuda_device(std::string_view backend) {
  const auto name = parse_backend_name(backend);
  return name && name->kind == BackendKind::cuda ? name->device.value_or(0) : -1;
}

}  // namespace meshsmooth::detail
