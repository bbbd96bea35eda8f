#pragma once

#include <algorithm>
#include <cstring>
#include <string>

#include "error.hpp"

namespace meshsmooth::c {

/// Reads a structure of a caller who may know fewer members than this library.
/// @param defaults what members have that the caller does not know
/// @throws InvalidOption ARGUMENT_INVALID: null, or of a size that cannot be
template <class Structure>
[[nodiscard]] Structure read_structure(const Structure* given, const std::string& name,
                                       const Structure& defaults = {}) {
  need(given, name);
  need_size(given->size, sizeof(Structure), "meshsmooth_" + name);
  Structure known = defaults;
  std::memcpy(&known, given, given->size);
  return known;
}

/// Writes as much of a structure as its caller has.
/// @throws InvalidOption ARGUMENT_INVALID: null, or of a size that cannot be
template <class Structure>
void write_structure(Structure value, std::size_t size, Structure* result,
                     const std::string& name) {
  need(result, name);
  need_size(size, sizeof(Structure), "meshsmooth_" + name);
  value.size = size;
  std::memcpy(result, &value, size);
}

}  // namespace meshsmooth::c
