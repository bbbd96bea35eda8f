#include <vector>

#include "msh/msh_content.hpp"

namespace meshsmooth::formats {
namespace {

/// Versions 1 to 3: "tag x y z". With parameters: "dimension entity" after them, and u on a curve,
/// u and v on a surface. In version 3 any numbers may come after them: 0, or entity, dimension and
/// parameters.
void read_listed_nodes(MshNumbers& numbers, bool parametric, CoordinateFields& found) {
  Scanner& scanner = numbers.scanner();
  const std::size_t count = scanner.count();
  scanner.line();
  for (std::size_t node = 0; node < count; ++node) {
    const std::int64_t tag = numbers.first_tag("node", node, count);
    found.add(tag, numbers.coordinates(), scanner);
    if (parametric) {
      const int dimension = numbers.integer();
      (void)numbers.integer();
      if (dimension == 1 || dimension == 2) numbers.skip_reals(static_cast<std::size_t>(dimension));
    }
    if (numbers.format().version == 30) {
      scanner.line();
    } else {
      numbers.end_of_record("node", tag);
    }
  }
}

struct Block {
  int dimension;
  bool parametric;
  std::size_t count;
};

Block read_block(const std::filesystem::path& path, MshNumbers& numbers) {
  int dimension = numbers.integer();
  const int second = numbers.integer();
  if (numbers.format().version < 41) dimension = second;  // the entity's tag comes first
  if (dimension < 0 || dimension > 3) {
    fail("FORMAT_ERROR", path,
         "a block of nodes is of an entity of dimension " + std::to_string(dimension) +
             ", which is not in [0, 3]");
  }
  const bool parametric = numbers.integer() != 0;
  return {dimension, parametric, numbers.count(3 * sizeof(double))};
}

/// Version 4.1: the tags of a block, then its coordinates; 4.0: "tag x y z" as before. In version
/// 4.0 volumes and points have no parameters.
void read_block_nodes(MshNumbers& numbers, const Block& block, std::size_t before,
                      std::size_t announced, CoordinateFields& found) {
  Scanner& scanner = numbers.scanner();
  const bool old = numbers.format().version < 41;
  const auto dimension = static_cast<std::size_t>(block.dimension);
  const std::size_t parameters = !block.parametric || (old && dimension == 3) ? 0 : dimension;
  std::vector<std::int64_t> tags;
  if (!old) tags.reserve(block.count);
  for (std::size_t node = 0; node < block.count && !old; ++node) {
    tags.push_back(numbers.first_tag("node", before + node, announced));
  }
  for (std::size_t node = 0; node < block.count; ++node) {
    const std::int64_t tag = old ? numbers.first_tag("node", before + node, announced) : tags[node];
    found.add(tag, numbers.coordinates(), scanner);
    numbers.skip_reals(parameters);
  }
}

/// Version 4: blocks by entity.
void read_blocks(const std::filesystem::path& path, MshNumbers& numbers, CoordinateFields& found) {
  numbers.end_of_name();
  const std::size_t blocks = numbers.count(3 * sizeof(std::int32_t));
  const std::size_t announced = numbers.count(3 * sizeof(double));
  if (numbers.format().version >= 41) {
    (void)numbers.tag();  // the least and the greatest
    (void)numbers.tag();
  }
  std::size_t read = 0;
  for (std::size_t index = 0; index < blocks; ++index) {
    const Block block = read_block(path, numbers);
    read_block_nodes(numbers, block, read, announced, found);
    read += block.count;
  }
  if (read == announced) return;
  fail("FORMAT_ERROR", path,
       "$Nodes announces " + std::to_string(announced) + " nodes, its blocks have " +
           std::to_string(read) + "; correct the counts");
}

}  // namespace

void read_msh_nodes(const std::filesystem::path& path, MshNumbers& numbers, bool parametric,
                    CoordinateFields& found) {
  if (numbers.format().version < 40) {
    read_listed_nodes(numbers, parametric, found);
  } else {
    read_blocks(path, numbers, found);
  }
}

}  // namespace meshsmooth::formats
