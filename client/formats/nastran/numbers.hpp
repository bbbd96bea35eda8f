#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace meshsmooth::formats {

/// A number as Nastran writes it: "1.5E-3", "1.5D-3", "1.5-3", ".5", "7"; blank is 0. None: it is
/// no number, or too large for a double.
[[nodiscard]] std::optional<double> parse_nastran_real(std::string_view word);
/// A whole number without a decimal point.
[[nodiscard]] std::optional<std::int64_t> parse_nastran_integer(std::string_view word);

/// The number with a decimal point, in at most `columns` characters (at least 8): rounded to the
/// nearest number that fits, which may be written without E ("1.2345-7"). Not padded.
[[nodiscard]] std::string format_nastran_real(double value, std::size_t columns);

}  // namespace meshsmooth::formats
