#pragma once

#include <charconv>
#include <string_view>

namespace meshsmooth::detail {

/// N of "cuda:N", 0 of "cuda", else -1.
[[nodiscard]] inline int cuda_device(std::string_view backend) {
  if (backend == "cuda") return 0;
  int device = -1;
  if (!backend.starts_with("cuda:")) return -1;
  const char* const end = backend.data() + backend.size();
  const auto [rest, error] = std::from_chars(backend.data() + 5, end, device);
  return error == std::errc() && rest == end ? device : -1;
}

}  // namespace meshsmooth::detail
