#pragma once

#include <cstddef>
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

/// Eight records of four floats, `*record(t)`, by number: one load and a shuffle a record.
template <class Record>
[[gnu::always_inline]] inline void transpose_eight(const Record& record, float (&columns)[4][8]) {
  using Four [[gnu::vector_size(16)]] = float;
  using Eight [[gnu::vector_size(32)]] = float;
  Eight pair[4];
  for (std::size_t t = 0; t < 4; ++t) {
    Four low, high;
    static_assert(sizeof(*record(t)) == sizeof low);
    std::memcpy(&low, record(t), sizeof low);
    std::memcpy(&high, record(t + 4), sizeof high);
    pair[t] = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
  }
  const Eight xy01 = __builtin_shufflevector(pair[0], pair[1], 0, 8, 1, 9, 4, 12, 5, 13);
  const Eight xy23 = __builtin_shufflevector(pair[2], pair[3], 0, 8, 1, 9, 4, 12, 5, 13);
  const Eight zw01 = __builtin_shufflevector(pair[0], pair[1], 2, 10, 3, 11, 6, 14, 7, 15);
  const Eight zw23 = __builtin_shufflevector(pair[2], pair[3], 2, 10, 3, 11, 6, 14, 7, 15);
  const Eight x = __builtin_shufflevector(xy01, xy23, 0, 1, 8, 9, 4, 5, 12, 13);
  const Eight y = __builtin_shufflevector(xy01, xy23, 2, 3, 10, 11, 6, 7, 14, 15);
  const Eight z = __builtin_shufflevector(zw01, zw23, 0, 1, 8, 9, 4, 5, 12, 13);
  const Eight w = __builtin_shufflevector(zw01, zw23, 2, 3, 10, 11, 6, 7, 14, 15);
  std::memcpy(columns[0], &x, sizeof x);
  std::memcpy(columns[1], &y, sizeof y);
  std::memcpy(columns[2], &z, sizeof z);
  std::memcpy(columns[3], &w, sizeof w);
}

}  // namespace meshsmooth::detail
