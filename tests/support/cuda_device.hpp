#pragma once

// Tests that need a CUDA device. Without one they are skipped, which ctest shows;
// with MESHSMOOTH_REQUIRE_CUDA=1 in the environment they fail, so that a run on a
// machine with a GPU cannot pass without having used it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "meshsmooth/smoother.hpp"

namespace meshsmooth::test {

/// Whether there is a device that this build has code for.
inline bool cuda_available() {
  const std::vector<BackendInfo> backends = list_backends();
  return std::any_of(backends.begin(), backends.end(), [](const BackendInfo& info) {
    return info.name.starts_with("cuda") && info.available;
  });
}

inline bool cuda_required() {
  const char* const value = std::getenv("MESHSMOOTH_REQUIRE_CUDA");
  return value != nullptr && std::string_view(value) == "1";
}

/// The first line of a test or of a fixture's SetUp.
#define MESHSMOOTH_NEED_CUDA()                                                        \
  do {                                                                                \
    if (::meshsmooth::test::cuda_available()) break;                                  \
    if (::meshsmooth::test::cuda_required()) {                                        \
      FAIL() << "MESHSMOOTH_REQUIRE_CUDA=1, but there is no CUDA device to test on";  \
    }                                                                                 \
    GTEST_SKIP() << "no CUDA device here; run scripts/bundle and its gpu-test there"; \
  } while (false)

class CudaTest : public ::testing::Test {
 protected:
  void SetUp() override { MESHSMOOTH_NEED_CUDA(); }
};

}  // namespace meshsmooth::test
