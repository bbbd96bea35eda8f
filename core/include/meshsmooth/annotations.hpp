#pragma once

/// Marks a function that runs on the host and on a CUDA device; empty for a C++ compiler.
#if defined(__CUDACC__)
#define MESHSMOOTH_HD __host__ __device__
#else
#define MESHSMOOTH_HD
#endif

/// Keeps rarely called code out of its callers' registers and instruction cache.
#define MESHSMOOTH_OUTLINE __attribute__((noinline))

/// Makes nvcc unroll the loop that follows; host compilers decide themselves.
#if defined(__CUDA_ARCH__)
#define MESHSMOOTH_PRAGMA(text) _Pragma(#text)
#define MESHSMOOTH_UNROLL(times) MESHSMOOTH_PRAGMA(unroll times)
#else
#define MESHSMOOTH_UNROLL(times)
#endif
