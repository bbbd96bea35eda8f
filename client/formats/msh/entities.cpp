#include <algorithm>
#include <cstdlib>

#include "msh/msh_content.hpp"

namespace meshsmooth::formats {
namespace {

/// Numbers of four bytes after their count.
void skip_integers(MshNumbers& numbers, std::size_t count) {
  for (std::size_t number = 0; number < count; ++number) (void)numbers.integer();
}

/// What a partitioned entity has after its tag. Version 4.0 has four bytes for the count.
void skip_parent(MshNumbers& numbers) {
  skip_integers(numbers, 2);
  const bool old = numbers.format().version < 41;
  skip_integers(numbers, old ? numbers.small_count(sizeof(std::int32_t))
                             : numbers.count(sizeof(std::int32_t)));
}

void skip_partitions(MshNumbers& numbers) {
  const bool old = numbers.format().version < 41;
  (void)(old ? numbers.small_count(0) : numbers.count(0));
  const std::size_t ghosts =
      old ? numbers.small_count(2 * sizeof(std::int32_t)) : numbers.count(2 * sizeof(std::int32_t));
  skip_integers(numbers, 2 * ghosts);
}

void add_group(std::vector<int>& groups, int number) {
  // Below zero: the group sees the entity from the other side.
  const auto group = static_cast<int>(std::abs(std::int64_t{number}));
  if (std::ranges::find(groups, group) == groups.end()) groups.push_back(group);
}

}  // namespace

void read_msh_entities(MshNumbers& numbers, bool partitioned, MshContent& content) {
  numbers.end_of_name();
  if (partitioned) skip_partitions(numbers);
  std::array<std::size_t, 4> counts{};
  for (std::size_t& count : counts) count = numbers.count(sizeof(std::int32_t));
  for (int dimension = 0; dimension < 4; ++dimension) {
    for (std::size_t index = 0; index < counts[static_cast<std::size_t>(dimension)]; ++index) {
      const int tag = numbers.integer();
      if (partitioned) skip_parent(numbers);
      const bool is_place = dimension == 0 && numbers.format().version >= 41;
      const bool has_box = numbers.format().version >= 40;
      if (has_box) numbers.skip_reals(is_place ? 3 : 6);
      if (!has_box && dimension > 0) skip_integers(numbers, numbers.count(sizeof(std::int32_t)));
      std::vector<int>& groups = content.physicals[{dimension, tag}];
      const std::size_t group_count = numbers.count(sizeof(std::int32_t));
      for (std::size_t group = 0; group < group_count; ++group) {
        add_group(groups, numbers.integer());
      }
      if (has_box && dimension > 0) skip_integers(numbers, numbers.count(sizeof(std::int32_t)));
    }
  }
}

void read_msh_names(MshNumbers& numbers, MshContent& content) {
  Scanner& scanner = numbers.scanner();
  const std::size_t count = scanner.count();
  for (std::size_t name = 0; name < count; ++name) {
    const bool has_dimension = numbers.format().version > 20;
    const int dimension = has_dimension ? scanner.number<int>() : -1;
    const auto group = static_cast<int>(std::abs(std::int64_t{scanner.number<int>()}));
    const std::string_view line = scanner.line();
    const std::size_t first = line.find('"');
    const std::size_t last = line.rfind('"');
    if (first == std::string_view::npos || first == last) {
      scanner.refuse("the name of a physical group in quotes", line);
    }
    content.physical_names[{dimension, group}] = line.substr(first + 1, last - first - 1);
  }
}

}  // namespace meshsmooth::formats
