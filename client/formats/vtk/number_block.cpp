#include "vtk/number_block.hpp"

#include <algorithm>
#include <cstdint>

#include "vtk/binary_block.hpp"
#include "vtk/number_text.hpp"

namespace meshsmooth::formats {
namespace {

using Encoding = NumberBlock::Encoding;

/// Calls the functor with a value of the C++ type. False: there is no such type.
template <class Functor>
bool visit_type(const NumberType& type, Functor functor) {
  using Kind = NumberType::Kind;
  const bool natural = type.kind == Kind::natural;
  if (type == kFloat32) return functor(float{}), true;
  if (type == kFloat64) return functor(double{}), true;
  if (type.kind == Kind::real) return false;
  switch (type.bytes) {
    case 1:
      return natural ? functor(std::uint8_t{}) : functor(std::int8_t{}), true;
    case 2:
      return natural ? functor(std::uint16_t{}) : functor(std::int16_t{}), true;
    case 4:
      return natural ? functor(std::uint32_t{}) : functor(std::int32_t{}), true;
    case 8:
      return natural ? functor(std::uint64_t{}) : functor(std::int64_t{}), true;
    default:
      return false;
  }
}

std::vector<Edit> replace_binary(std::string_view file, const NumberBlock& block,
                                 std::span<const double> numbers, const NumberType& type) {
  const auto before = read_binary(file, block);
  if (!before) return {};
  std::string bytes = before->bytes;
  if (bytes.size() != numbers.size() * block.type.bytes) return {};
  if (type != block.type) bytes.assign(numbers.size() * type.bytes, '\0');
  visit_type(type, [&](auto as) {
    using T = decltype(as);
    for (std::size_t place = 0; place < numbers.size(); ++place) {
      store(bytes.data() + place * sizeof(T), static_cast<T>(numbers[place]), block.big_endian);
    }
  });
  if (bytes == before->bytes) return {};
  return {{block.begin, before->length, write_binary(block, *before, bytes)}};
}

std::vector<Edit> replace_text(std::string_view file, const NumberBlock& block,
                               std::span<const double> numbers, const NumberType& type) {
  std::string text;
  std::size_t copied = block.begin;
  NumberWords words(file.substr(0, block.limit), block.begin);
  bool changed = false;
  for (const double number : numbers) {
    const std::string_view word = words.next();
    const auto before = parse_number(word, type == kFloat32);
    const double now = type == kFloat32 ? static_cast<double>(static_cast<float>(number)) : number;
    if (before && same_number(*before, now)) continue;
    const auto begin = static_cast<std::size_t>(word.data() - file.data());
    text += file.substr(copied, begin - copied);
    append_number(text, now, type == kFloat32);
    copied = begin + word.size();
    changed = true;
  }
  if (!changed) return {};
  return {{block.begin, copied - block.begin, std::move(text)}};
}

}  // namespace

std::optional<std::vector<double>> read_numbers(std::string_view file, const NumberBlock& block) {
  if (block.begin > block.limit || block.limit > file.size()) return std::nullopt;
  std::vector<double> numbers;
  if (block.encoding == Encoding::ascii) {
    NumberWords words(file.substr(0, block.limit), block.begin);
    const bool all = block.count == NumberBlock::kAll;
    while (all || numbers.size() < block.count) {
      const std::string_view word = words.next();
      if (all && word.empty()) break;
      const auto number = parse_number(word, block.type == kFloat32);
      if (!number) return std::nullopt;
      numbers.push_back(*number);
    }
    return numbers;
  }
  const auto binary = read_binary(file, block);
  const bool known = binary && visit_type(block.type, [&](auto as) {
                       using T = decltype(as);
                       numbers.resize(binary->bytes.size() / sizeof(T));
                       for (std::size_t place = 0; place < numbers.size(); ++place) {
                         const char* bytes = binary->bytes.data() + place * sizeof(T);
                         numbers[place] = static_cast<double>(load<T>(bytes, block.big_endian));
                       }
                     });
  if (!known) return std::nullopt;
  return numbers;
}

std::vector<Edit> replace_numbers(std::string_view file, const NumberBlock& block,
                                  std::span<const double> numbers, const NumberType& type) {
  return block.encoding == Encoding::ascii ? replace_text(file, block, numbers, type)
                                           : replace_binary(file, block, numbers, type);
}

std::string apply_edits(std::string_view file, std::vector<Edit>& edits) {
  std::ranges::sort(edits, {}, &Edit::begin);
  std::string result;
  result.reserve(file.size() + file.size() / 8);
  std::size_t copied = 0;
  for (const Edit& edit : edits) {
    result += file.substr(copied, edit.begin - copied);
    result += edit.bytes;
    copied = edit.begin + edit.length;
  }
  return result += file.substr(copied);
}

}  // namespace meshsmooth::formats
