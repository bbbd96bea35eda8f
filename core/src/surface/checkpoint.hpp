#pragma once

#include <cstdint>
#include <functional>

namespace meshsmooth::detail {

/// Calls `check` once in so many steps, of loops and of comparisons in a sort; what it throws ends
/// them.
class Checkpoint {
 public:
  explicit Checkpoint(const std::function<void()>& check) : check_(check) {}

  void operator()() {
    if (++steps_ % kSteps == 0 && check_) check_();
  }

 private:
  static constexpr std::uint32_t kSteps = 1 << 16;  // about a millisecond of comparisons

  const std::function<void()>& check_;
  std::uint32_t steps_ = 0;
};

}  // namespace meshsmooth::detail
