#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>

namespace meshsmooth::test {

/// For what must happen while a time runs out that the test has to choose before: a deadline
/// that passes in a state, on a machine of whatever load. `attempt` says whether the state was
/// reached in the time that it was given; if not, it gets more.
inline void with_growing_time(const std::function<bool(std::chrono::milliseconds)>& attempt) {
  for (std::chrono::milliseconds time(50); !attempt(time); time *= 3) {
    ASSERT_LT(time, std::chrono::minutes(1)) << "never so far before the time was over";
  }
}

}  // namespace meshsmooth::test
