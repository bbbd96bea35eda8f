#pragma once

namespace meshsmooth::detail {

/// A position and the sweep it belongs to, accessed by one 16-byte operation: whoever reads it
/// knows from the datum itself whether it is the one awaited, without flag or fence.
struct alignas(16) TaggedPosition {
  float x, y, z;
  int tag;

  /// Relaxed and indivisible: sees a store of any block as a whole or not at all.
  static __device__ TaggedPosition load(const TaggedPosition* from) {
    unsigned long long low = 0, high = 0;
    asm volatile(
        "{ .reg .b128 whole; ld.relaxed.gpu.global.b128 whole, [%2]; mov.b128 {%0, %1}, whole; }"
        : "=l"(low), "=l"(high)
        : "l"(from)
        : "memory");
    return {__uint_as_float(static_cast<unsigned int>(low)),
            __uint_as_float(static_cast<unsigned int>(low >> 32)),
            __uint_as_float(static_cast<unsigned int>(high)), static_cast<int>(high >> 32)};
  }
  static __device__ void store(TaggedPosition* to, const TaggedPosition& value) {
    const auto joined = [](unsigned int low, unsigned int high) {
      return static_cast<unsigned long long>(high) << 32 | low;
    };
    const unsigned long long low = joined(__float_as_uint(value.x), __float_as_uint(value.y));
    const unsigned long long high =
        joined(__float_as_uint(value.z), static_cast<unsigned int>(value.tag));
    asm volatile(
        "{ .reg .b128 whole; mov.b128 whole, {%0, %1}; st.relaxed.gpu.global.b128 [%2], whole; }"
        :
        : "l"(low), "l"(high), "l"(to)
        : "memory");
  }
};

}  // namespace meshsmooth::detail
