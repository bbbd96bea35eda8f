#pragma once

#include <cstdint>

namespace meshsmooth::formats {

/// The step of SplitMix64 (Steele, Lea, Flood, OOPSLA 2014): neighbouring inputs give
/// unrelated outputs.
[[nodiscard]] constexpr std::uint64_t mixed_bits(std::uint64_t bits) {
  bits += 0x9e3779b97f4a7c15ULL;
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9ULL;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebULL;
  return bits ^ (bits >> 31);
}

/// In [-1, 1); depends on the three numbers alone, not on the order of calls.
[[nodiscard]] constexpr double signed_hash(std::uint64_t seed, std::uint64_t node,
                                           std::uint64_t axis) {
  const std::uint64_t bits = mixed_bits(mixed_bits(seed) ^ mixed_bits(3 * node + axis));
  return static_cast<double>(bits >> 11) * 0x1.0p-52 - 1;
}

}  // namespace meshsmooth::formats
