#pragma once

#include <chrono>
#include <string>
#include <utility>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {

/// Refused for now: at the rate at which memory or places are freed, there will be room after
/// `retry_delay`.
class Busy : public OutOfMemory {
 public:
  Busy(std::string reason, const std::string& message, ErrorDetails details,
       std::chrono::nanoseconds retry_delay)
      : OutOfMemory(std::move(reason), message, std::move(details)), retry_delay_(retry_delay) {}
  [[nodiscard]] std::chrono::nanoseconds retry_delay() const noexcept { return retry_delay_; }

 private:
  std::chrono::nanoseconds retry_delay_;
};

}  // namespace meshsmooth::server
