#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "error.hpp"
#include "meshsmooth.h"
#include "meshsmooth/mesh.hpp"
#include "meshsmooth/options.hpp"

namespace meshsmooth::c {

/// A mesh of C, copied, and what else it brings to a job, which lies where the caller has it.
struct ReadMesh {
  Mesh mesh;
  JobInput input;
};

/// Reads a mesh. Looks at pointers, types and sizes only; the job checks the rest. O(nodes +
/// elements).
/// @throws InvalidOption ARGUMENT_INVALID
[[nodiscard]] ReadMesh read_mesh(const meshsmooth_mesh* given);

/// @returns an array of the caller; null is empty
/// @throws InvalidOption ARGUMENT_INVALID: null with a count, or a count that cannot be
template <class Value>
[[nodiscard]] std::span<const Value> array_of(const void* array, std::int64_t count,
                                              const std::string& field) {
  constexpr auto kMost = std::numeric_limits<std::ptrdiff_t>::max() / sizeof(Value);
  if (count < 0 || static_cast<std::uint64_t>(count) > kMost) {
    throw invalid_argument(field, "has " + std::to_string(count) + " entries");
  }
  if (count > 0) need(array, field);
  return {static_cast<const Value*>(array), static_cast<std::size_t>(count)};
}

/// @returns the same as positions
[[nodiscard]] PositionsView view_like(bool float32, const void* array, std::int64_t count,
                                      const std::string& field);

/// Writes positions into an array of C of the same scalar type. O(nodes).
void write_positions(const PositionsView& positions, void* result);

}  // namespace meshsmooth::c
