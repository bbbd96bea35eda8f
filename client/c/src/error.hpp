#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "meshsmooth.h"
#include "meshsmooth/error.hpp"

/// An error as C has it: texts that stay where they are until it is freed.
struct meshsmooth_error {
  int code = MESHSMOOTH_UNKNOWN;
  std::string reason;
  std::string message;
  std::string hint;
  meshsmooth::ErrorDetails details;
  std::optional<std::chrono::nanoseconds> retry_delay;
};

namespace meshsmooth::c {

/// @returns the error of an argument that C cannot mean
[[nodiscard]] InvalidOption invalid_argument(const std::string& field, const std::string& what);
/// @returns the error of a number that is out of its range
[[nodiscard]] InvalidOption out_of_range(const std::string& field, double value,
                                         const std::string& range);

/// Checks that a pointer is not null.
/// @throws InvalidOption ARGUMENT_INVALID
void need(const void* pointer, const std::string& field);

/// Checks the size of a structure of which this library knows `known` bytes.
/// @throws InvalidOption ARGUMENT_INVALID
void need_size(std::size_t size, std::size_t known, const std::string& structure);

/// Makes an error of the exception that is being handled, where the caller wants one.
/// @returns its status
int report_exception(meshsmooth_error** error) noexcept;

/// Runs the body of a function of the interface; what it throws becomes status and error.
template <class Body>
int guarded(meshsmooth_error** error, Body&& body) noexcept {
  if (error != nullptr) *error = nullptr;
  try {
    std::forward<Body>(body)();
    return MESHSMOOTH_OK;
  } catch (...) {
    return report_exception(error);
  }
}

}  // namespace meshsmooth::c
