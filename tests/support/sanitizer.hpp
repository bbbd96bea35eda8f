#pragma once

namespace meshsmooth::testing {

/// Under the address sanitizer a process holds freed memory for a while, and ends where a limit
/// leaves it none: tests of either have nothing to measure.
#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kAddressSanitizer = true;
#else
inline constexpr bool kAddressSanitizer = false;
#endif

#if defined(__SANITIZE_THREAD__)
inline constexpr bool kThreadSanitizer = true;
#else
inline constexpr bool kThreadSanitizer = false;
#endif

}  // namespace meshsmooth::testing
