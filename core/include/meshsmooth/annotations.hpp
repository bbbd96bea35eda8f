#pragma once

/// Marks a function that runs on the host and on a CUDA device; vanishes for a
/// plain C++ compiler.
#if defined(__CUDACC__)
#define MESHSMOOTH_HD __host__ __device__
#else
#define MESHSMOOTH_HD
#endif
