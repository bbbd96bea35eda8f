#include "msh/msh_content.hpp"

namespace meshsmooth::formats {
namespace {

/// The transformation of a link, if it has one; returns how many pairs of nodes follow.
std::size_t skip_transformation(MshNumbers& numbers, bool text) {
  Scanner& scanner = numbers.scanner();
  if (numbers.format().version >= 41) {
    numbers.skip_reals(numbers.count(text ? 1 : sizeof(double)));
    return numbers.count(2);
  }
  if (text) {
    const std::string_view word = scanner.token();
    if (word != "Affine") return scanner.parse<std::size_t>(word);
    scanner.line();
    return scanner.count();
  }
  // Version 4.0: a number below zero announces it.
  const std::int64_t number = numbers.signed_count();
  if (number >= 0) return static_cast<std::size_t>(number);
  numbers.skip_reals(16);
  return numbers.count(2);
}

}  // namespace

void read_msh_periodic(MshNumbers& numbers, MshContent& content) {
  // Before version 4 it is text in binary files, too.
  const bool text = !numbers.binary() || numbers.format().version < 40;
  Scanner& scanner = numbers.scanner();
  numbers.end_of_name();
  const std::size_t link_count = text ? scanner.count() : numbers.count(12);
  for (std::size_t link = 0; link < link_count; ++link) {
    for (int number = 0; number < 3; ++number) {  // dimension, entity, the other entity
      (void)(text ? scanner.number<int>() : numbers.integer());
    }
    const std::size_t pair_count = skip_transformation(numbers, text);
    for (std::size_t pair = 0; pair < pair_count; ++pair) {
      const auto tag = [&] { return text ? scanner.number<std::int64_t>() : numbers.tag(); };
      const std::int64_t first = tag();
      content.periodic_nodes.push_back({first, tag()});
    }
  }
}

}  // namespace meshsmooth::formats
