#include <cstdlib>
#include <limits>
#include <vector>

#include "msh/msh_content.hpp"

namespace meshsmooth::formats {
namespace {

/// Physical groups have a sign for the orientation.
std::int32_t without_sign(int physical) {
  if (physical == std::numeric_limits<int>::min()) return 0;
  return std::abs(physical);
}

class ElementReader {
 public:
  ElementReader(const std::filesystem::path& path, MshNumbers& numbers, MshContent& content)
      : path_(path), numbers_(numbers), content_(content) {}

  /// "tag type physical entity nodes node …".
  void read_version_1() {
    Scanner& scanner = numbers_.scanner();
    const std::size_t count = announced_in_a_line();
    for (std::size_t index = 0; index < count; ++index) {
      const std::int64_t tag = numbers_.first_tag("element", index, count);
      const MshElementType& type = msh_element_type(path_, numbers_.integer(), tag);
      const int physical = numbers_.integer();
      const int entity = numbers_.integer();
      const std::size_t node_count = scanner.count();
      if (type.node_count != 0 && node_count != static_cast<std::size_t>(type.node_count)) {
        scanner.refuse(std::to_string(type.node_count) + " nodes of element " +
                           std::to_string(tag) + " by its type",
                       std::to_string(node_count));
      }
      add(tag, type, node_count, {entity, without_sign(physical), type.dimension});
      numbers_.end_of_record("element", tag);
    }
  }

  /// "tag type tags tag … node …". The first two tags are the physical group and the entity; then
  /// partitions.
  void read_version_2() {
    const std::size_t count = announced_in_a_line();
    for (std::size_t index = 0; index < count; ++index) {
      const std::int64_t tag = numbers_.first_tag("element", index, count);
      const MshElementType& type = msh_element_type(path_, numbers_.integer(), tag);
      const std::size_t tag_count = numbers_.scanner().count();
      const Place place = read_tags(tag_count, type);
      std::size_t node_count = static_cast<std::size_t>(type.node_count);
      if (type.node_count == 0) node_count = numbers_.scanner().count();
      add(tag, type, node_count, place);
      numbers_.end_of_record("element", tag);
    }
  }

  /// "tag type entity numbers node … number …": after the nodes the element of which it is a part,
  /// and partitions.
  void read_version_3() {
    const std::size_t count = announced_in_a_line();
    for (std::size_t index = 0; index < count; ++index) {
      const std::int64_t tag = numbers_.first_tag("element", index, count);
      const MshElementType& type = msh_element_type(path_, numbers_.integer(), tag);
      const int entity = numbers_.integer();
      const std::size_t numbers = numbers_.scanner().count();
      const auto node_count = static_cast<std::size_t>(fixed_type(type, tag).node_count);
      if (numbers < node_count) {
        numbers_.scanner().refuse("at least " + std::to_string(node_count) +
                                      " numbers of element " + std::to_string(tag) + " by its type",
                                  std::to_string(numbers));
      }
      add(tag, type, node_count, {entity, 0, type.dimension});
      for (std::size_t other = node_count; other < numbers; ++other) (void)numbers_.integer();
      numbers_.end_of_record("element", tag);
    }
  }

  /// Blocks of "type elements tags", then for each element "tag tag … node …", four bytes each.
  void read_binary_version_2() {
    const std::size_t announced = announced_in_a_line();
    std::size_t read = 0;
    while (read < announced) {
      const int number = numbers_.integer();
      const std::size_t count = numbers_.small_count(2 * sizeof(std::int32_t));
      const std::size_t tag_count = numbers_.small_count(0);
      if (count == 0 || count > announced - read) {
        numbers_.scanner().refuse("at most " + std::to_string(announced - read) +
                                      " more elements in a block, and at least one",
                                  std::to_string(count));
      }
      for (std::size_t element = 0; element < count; ++element) {
        const std::int64_t tag = numbers_.tag();
        const MshElementType& type = fixed_type(number, tag);
        const Place place = read_tags(tag_count, type);
        add(tag, type, static_cast<std::size_t>(type.node_count), place);
      }
      read += count;
    }
  }

  /// Blocks by entity.
  void read_version_4() {
    const bool old = numbers_.format().version < 41;
    numbers_.end_of_name();
    const std::size_t blocks = numbers_.count(3 * sizeof(std::int32_t));
    const std::size_t announced = numbers_.count(2 * sizeof(std::int32_t));
    for (int skipped = 0; skipped < (old ? 0 : 2); ++skipped) (void)numbers_.tag();
    std::size_t read = 0;
    for (std::size_t block = 0; block < blocks; ++block) {
      const int first = numbers_.integer();
      const int second = numbers_.integer();
      const int number = numbers_.integer();
      const std::size_t count = numbers_.count(2 * sizeof(std::int32_t));
      const Place place = {old ? first : second, 0, old ? second : first};
      for (std::size_t element = 0; element < count; ++element) {
        const std::int64_t tag = numbers_.first_tag("element", read + element, announced);
        const MshElementType& type = fixed_type(number, tag);
        add(tag, type, static_cast<std::size_t>(type.node_count), place);
        numbers_.end_of_record("element", tag);
      }
      read += count;
    }
    if (read == announced) return;
    fail("FORMAT_ERROR", path_,
         "$Elements announces " + std::to_string(announced) + " elements, its blocks have " +
             std::to_string(read) +
             (read < announced ? ": element " + std::to_string(read + 1) + " is missing" : "") +
             "; correct the counts");
  }

 private:
  struct Place {
    std::int32_t entity;
    std::int32_t physical;
    std::int32_t dimension;
  };

  /// Also moves to the next line.
  std::size_t announced_in_a_line() {
    const std::size_t count = numbers_.scanner().count();
    numbers_.scanner().line();
    return count;
  }

  const MshElementType& fixed_type(int number, std::int64_t tag) const {
    return fixed_type(msh_element_type(path_, number, tag), tag);
  }

  /// Where the file does not say how many nodes an element has.
  const MshElementType& fixed_type(const MshElementType& type, std::int64_t tag) const {
    if (type.node_count != 0) return type;
    fail("ELEMENT_NOT_SUPPORTED", path_,
         "element " + std::to_string(tag) +
             " is a polygon or polyhedron in a block of elements of one size; save the mesh as "
             "MSH 2.2 in ASCII");
  }

  Place read_tags(std::size_t tag_count, const MshElementType& type) {
    Place place{0, 0, type.dimension};
    for (std::size_t index = 0; index < tag_count; ++index) {
      const int tag = numbers_.integer();
      if (index == 0) place.physical = without_sign(tag);
      if (index == 1) place.entity = tag;
    }
    return place;
  }

  void add(std::int64_t tag, const MshElementType& type, std::size_t node_count, Place place) {
    content_.elements.push_back({tag, &type, content_.node_tags.size(),
                                 static_cast<std::int32_t>(node_count), place.entity,
                                 place.physical, place.dimension});
    for (std::size_t node = 0; node < node_count; ++node) {
      content_.node_tags.push_back(numbers_.tag());
    }
  }

  const std::filesystem::path& path_;
  MshNumbers& numbers_;
  MshContent& content_;
};

}  // namespace

void read_msh_elements(const std::filesystem::path& path, MshNumbers& numbers,
                       MshContent& content) {
  ElementReader reader(path, numbers, content);
  if (numbers.format().version >= 40) {
    reader.read_version_4();
  } else if (numbers.format().version == 30) {
    reader.read_version_3();
  } else if (numbers.format().version < 20) {
    reader.read_version_1();
  } else if (numbers.binary()) {
    reader.read_binary_version_2();
  } else {
    reader.read_version_2();
  }
}

}  // namespace meshsmooth::formats
