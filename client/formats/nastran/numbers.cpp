#include "nastran/numbers.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

namespace meshsmooth::formats {
namespace {

/// Of text that starts with a digit or a point. `rest`: what follows the number. A number that is
/// too small becomes 0, as in Fortran.
std::optional<double> parse_plain(std::string_view text, std::string_view& rest) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  rest = text.substr(static_cast<std::size_t>(end - text.data()));
  if (error == std::errc()) return value;
  if (error != std::errc::result_out_of_range) return std::nullopt;
  const std::size_t exponent = text.find_first_of("eE");
  const bool small = exponent != std::string_view::npos && text.substr(exponent + 1, 1) == "-";
  return small ? std::optional(0.0) : std::nullopt;
}

/// "1.5D3" and "1.5+3", whose mantissa stands before `rest`.
std::optional<double> parse_exponent(std::string_view text, std::string_view rest) {
  constexpr std::size_t kMost = 60;
  if (text.size() > kMost) return std::nullopt;
  std::string number(text.substr(0, text.size() - rest.size()));
  if (std::string_view("dDeE").find(rest.front()) != std::string_view::npos) {
    rest.remove_prefix(1);
  } else if (rest.front() != '+' && rest.front() != '-') {
    return std::nullopt;
  }
  if (rest.starts_with('+')) rest.remove_prefix(1);
  const std::string_view digits = rest.starts_with('-') ? rest.substr(1) : rest;
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string_view::npos) {
    return std::nullopt;
  }
  number.append("e").append(rest);
  return parse_plain(number, rest);
}

std::string_view without_sign(std::string_view word) {
  return word.starts_with('+') || word.starts_with('-') ? word.substr(1) : word;
}

/// "-.5" of "-0.5", "1." of "1", "1.25-7" of "1.25e-07".
std::string in_nastran_form(std::string_view text) {
  const std::size_t e = std::min(text.find('e'), text.size());
  std::string number(text.substr(0, e));
  if (number.find('.') == std::string::npos) number += '.';
  number.erase(number.find_last_not_of('0') + 1);  // a point stops it
  const std::size_t first = number.starts_with('-') ? 1 : 0;
  if (number.size() > first + 2 && number.substr(first, 2) == "0.") number.erase(first, 1);
  if (e == text.size()) return number;
  std::string_view exponent = text.substr(e + 2);
  exponent.remove_prefix(std::min(exponent.find_first_not_of('0'), exponent.size() - 1));
  number += text[e + 1];
  return number.append(exponent);
}

/// In the form asked for, with as many digits as fit; empty: it needs more columns.
std::string rounded(double value, std::chars_format form, int digits, std::size_t columns) {
  std::array<char, 400> text{};
  for (; digits >= 0; --digits) {
    const auto [end, error] =
        std::to_chars(text.data(), text.data() + text.size(), value, form, digits);
    if (error != std::errc()) return {};
    std::string number = in_nastran_form({text.data(), end});
    if (number.size() <= columns) return number;
    const auto extra = static_cast<int>(number.size() - columns);
    if (extra > 1) digits -= extra - 1;
  }
  return {};
}

}  // namespace

std::optional<double> parse_nastran_real(std::string_view word) {
  if (word.empty()) return 0.0;
  const std::string_view text = without_sign(word);
  const bool starts = !text.empty() && ((text.front() >= '0' && text.front() <= '9') ||
                                        (text.front() == '.' && text.size() > 1));
  if (!starts) return std::nullopt;
  std::string_view rest;
  std::optional<double> value = parse_plain(text, rest);
  if (value && !rest.empty()) value = parse_exponent(text, rest);
  if (value && word.front() == '-') return -*value;
  return value;
}

std::optional<std::int64_t> parse_nastran_integer(std::string_view word) {
  const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

std::string format_nastran_real(double value, std::size_t columns) {
  if (value == 0) return std::signbit(value) ? "-0." : "0.";
  if (!std::isfinite(value)) return std::isnan(value) ? "NaN" : "Inf";
  std::array<char, 64> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  std::string shortest = in_nastran_form({text.data(), end});
  if (shortest.size() <= columns) return shortest;
  const auto most = static_cast<int>(std::min<std::size_t>(columns, 17));
  std::string with_exponent = rounded(value, std::chars_format::scientific, most, columns);
  const double size = std::abs(value);
  if (size >= 1e17 || size < 1e-17) return with_exponent;
  std::string fixed = rounded(value, std::chars_format::fixed, most, columns);
  if (fixed.empty()) return with_exponent;
  const double error_of_exponent = std::abs(*parse_nastran_real(with_exponent) - value);
  const double error_of_fixed = std::abs(*parse_nastran_real(fixed) - value);
  return error_of_fixed <= error_of_exponent ? fixed : with_exponent;
}

}  // namespace meshsmooth::formats
