#pragma once

#include <chrono>

#include "meshsmooth/error.hpp"
#include "meshsmooth/smoother.hpp"

namespace meshsmooth::detail {

/// Whether a job must end without a result; checked between pieces of work.
class Interrupt {
 public:
  explicit Interrupt(const JobControl& control) : control_(control) {}

  [[nodiscard]] bool requested() const {
    return control_.stop.stop_requested() || deadline_passed();
  }

  void check() const {
    if (control_.stop.stop_requested()) {
      throw Cancelled("CANCELLED", "the job was cancelled");
    }
    if (deadline_passed()) {
      throw DeadlineExceeded("DEADLINE_RUNNING", "the deadline passed while the job was running");
    }
  }

 private:
  [[nodiscard]] bool deadline_passed() const {
    return control_.deadline && std::chrono::steady_clock::now() >= *control_.deadline;
  }

  const JobControl& control_;
};

}  // namespace meshsmooth::detail
