#pragma once

#include <cstring>

namespace meshsmooth::detail {

/// Calls `function()`, inlined with all it calls, so that the compiler vectorizes loops in it.
template <class Function>
[[gnu::flatten]] auto run_plainly(const Function& function) {
  return function();
}

#if defined(__x86_64__)
template <class Function>
[[gnu::target("avx2"), gnu::flatten]] auto run_by_avx2(const Function& function) {
  return function();
}
#endif

/// `run_plainly`, by AVX2 where the processor has it: with the same bits, as nothing is fused and
/// sums keep their order.
template <class Function>
auto run_wide(const Function& function) {
#if defined(__x86_64__)
  static const bool wide = __builtin_cpu_supports("avx2") != 0;
  if (wide) return run_by_avx2(function);
#endif
  return run_plainly(function);
}

/// Writes four numbers at once. What is written number by number cannot be read as a vector before
/// all writes have left the processor.
[[gnu::always_inline]] inline void store_four(double* to, double a, double b, double c, double d) {
  using Four [[gnu::vector_size(4 * sizeof(double))]] = double;
  const Four four = {a, b, c, d};
  std::memcpy(to, &four, sizeof four);
}
[[gnu::always_inline]] inline void store_four(float* to, float a, float b, float c, float d) {
  using Four [[gnu::vector_size(4 * sizeof(float))]] = float;
  const Four four = {a, b, c, d};
  std::memcpy(to, &four, sizeof four);
}

}  // namespace meshsmooth::detail
