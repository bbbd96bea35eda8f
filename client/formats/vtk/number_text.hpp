#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace meshsmooth::formats {

/// The words of a text from a place on, between blanks and line ends.
class NumberWords {
 public:
  NumberWords(std::string_view text, std::size_t begin) : text_(text), position_(begin) {}
  /// Empty at the end of the text.
  std::string_view next();

 private:
  std::string_view text_;
  std::size_t position_;
};

/// A number as programs write them into VTK files: also nan, -nan(ind), inf and 1.#QNAN, numbers
/// beyond the range of the type, which are infinite or 0, and exponents after a D. `single`:
/// rounded once, to float32.
[[nodiscard]] std::optional<double> parse_number(std::string_view word, bool single);

/// Whether VTK's reader of text, a stream of C++, reads this number.
[[nodiscard]] bool is_plain_number(std::string_view word, double number);

/// With as few digits as give the same bits back.
void append_number(std::string& text, double number, bool single);

/// By bits, so that 0 is not -0; all NaN are the same.
[[nodiscard]] bool same_number(double a, double b);

}  // namespace meshsmooth::formats
