#include "vtk/number_text.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>

namespace meshsmooth::formats {
namespace {

template <class Real>
std::optional<double> parse(std::string_view word) {
  Real value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || error == std::errc::invalid_argument) return std::nullopt;
  if (error == std::errc::result_out_of_range) {
    const std::size_t exponent = word.find_first_of("eE");
    const bool tiny = exponent != std::string_view::npos && word.substr(exponent).find('-') == 1;
    value = tiny ? Real(0) : std::numeric_limits<Real>::infinity();
    if (word.starts_with('-')) value = -value;
  }
  return static_cast<double>(value);
}

}  // namespace

std::string_view NumberWords::next() {
  constexpr std::string_view kBlanks = " \t\r\n\v\f";
  const std::size_t begin = std::min(text_.find_first_not_of(kBlanks, position_), text_.size());
  position_ = std::min(text_.find_first_of(kBlanks, begin), text_.size());
  return text_.substr(begin, position_ - begin);
}

std::optional<double> parse_number(std::string_view word, bool single) {
  if (word.starts_with('+')) word.remove_prefix(1);
  if (const auto hash = word.find('#'); hash != std::string_view::npos) {  // Microsoft's
    const double sign = word.starts_with('-') ? -1 : 1;
    if (word.substr(hash).starts_with("#INF")) {
      return sign * std::numeric_limits<double>::infinity();
    }
    return std::numeric_limits<double>::quiet_NaN();
  }
  std::string with_e;
  if (word.find_first_of("dD") != std::string_view::npos) {
    with_e = word;
    std::ranges::replace_if(
        with_e, [](char c) { return c == 'd' || c == 'D'; }, 'e');
    if (word.find_first_of("0123456789") != std::string_view::npos) word = with_e;
  }
  return single ? parse<float>(word) : parse<double>(word);
}

bool is_plain_number(std::string_view word, double number) {
  return std::isfinite(number) && word.find_first_not_of("+-.0123456789eE") == word.npos;
}

void append_number(std::string& text, double number, bool single) {
  std::array<char, 64> digits{};
  const auto written = single ? std::to_chars(digits.data(), digits.data() + digits.size(),
                                              static_cast<float>(number))
                              : std::to_chars(digits.data(), digits.data() + digits.size(), number);
  text.append(digits.data(), written.ptr);
}

bool same_number(double a, double b) {
  if (std::isnan(a) || std::isnan(b)) return std::isnan(a) && std::isnan(b);
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace meshsmooth::formats
