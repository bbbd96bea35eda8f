#pragma once

#include <cstdint>
#include <string>

namespace meshsmooth::cli {

/// 633220 -> "633,220".
[[nodiscard]] std::string with_commas(std::int64_t count);

/// "1 element", "2,000 elements".
[[nodiscard]] std::string counted(std::int64_t count, const std::string& noun);

/// The share of `part` in `whole`, never rounded to 0 or 100 when it is not:
/// "1.7 %", "< 0.1 %", "> 99.9 %".
[[nodiscard]] std::string percentage(std::int64_t part, std::int64_t whole);

/// "350 us", "12.3 ms", "1.92 s", "12 min 03 s".
[[nodiscard]] std::string duration(double seconds);

/// "410 B", "5.1 kB", "120.0 MB".
[[nodiscard]] std::string byte_size(std::int64_t bytes);

}  // namespace meshsmooth::cli
