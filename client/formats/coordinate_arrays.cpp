#include "coordinate_arrays.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "content.hpp"
#include "hdf5_file.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using Place = std::array<double, 3>;

template <class Node>
Place place_of(const Node& node) {
  return {double(node.x), double(node.y), double(node.z)};
}

template <class Node>
std::vector<Node> gather(const CoordinateArrays& arrays,
                         const std::vector<std::vector<double>>& numbers, std::size_t count) {
  using Real = decltype(Node::x);
  const bool one = arrays.names.size() == 1;
  std::vector<Node> nodes(count);
  for (std::size_t node = 0; node < count; ++node) {
    Place place{};
    for (std::size_t axis = 0; axis < arrays.dimension; ++axis) {
      place[axis] = !one             ? numbers[axis][node]
                    : arrays.by_axis ? numbers[0][axis * count + node]
                                     : numbers[0][node * arrays.dimension + axis];
    }
    nodes[node] = {static_cast<Real>(place[0]), static_cast<Real>(place[1]),
                   static_cast<Real>(place[2])};
  }
  return nodes;
}

/// Rounding may leave something in a mesh that is flat.
void check_flat(const std::filesystem::path& path, const std::vector<Place>& places) {
  constexpr double kRounding = 1e-9;
  double size = 0;
  for (const Place& place : places) size = std::max({size, std::abs(place[0]), std::abs(place[1])});
  for (std::size_t node = 0; node < places.size(); ++node) {
    if (!(std::abs(places[node][2]) > kRounding * size)) continue;
    fail("FILE_NOT_WRITABLE", path,
         "the file has two coordinates a node, but node " + std::to_string(node) +
             " now has z = " + std::to_string(places[node][2]));
  }
}

}  // namespace

Positions positions_of(const std::filesystem::path& path, const CoordinateArrays& arrays,
                       const std::vector<std::vector<double>>& numbers) {
  if (arrays.dimension != 2 && arrays.dimension != 3) {
    fail("FORMAT_ERROR", path,
         "nodes have " + std::to_string(arrays.dimension) + " coordinates, not two or three");
  }
  const std::size_t count =
      numbers[0].size() / (numbers.size() == 1 ? arrays.dimension : std::size_t{1});
  const std::size_t length = numbers.size() == 1 ? count * arrays.dimension : count;
  for (std::size_t array = 0; array < numbers.size(); ++array) {
    if (numbers[array].size() == length) continue;
    fail("FORMAT_ERROR", path,
         "the array of coordinates \"" + arrays.names[array] + "\" has " +
             std::to_string(numbers[array].size()) + " numbers instead of " +
             std::to_string(length));
  }
  if (arrays.single_precision) return gather<Vec3f>(arrays, numbers, count);
  return gather<Vec3d>(arrays, numbers, count);
}

void append_positions(Positions& to, const Positions& more) {
  const auto size_of = [](const auto& nodes) { return nodes.size(); };
  if (std::visit(size_of, to) == 0) {
    to = more;
    return;
  }
  if (to.index() != more.index() && std::holds_alternative<std::vector<Vec3f>>(to)) {
    std::vector<Vec3d> wider;
    for (const Vec3f& node : std::get<std::vector<Vec3f>>(to)) {
      wider.push_back(vec3_cast<double>(node));
    }
    to = std::move(wider);
  }
  std::visit(
      [](auto& all, const auto& nodes) {
        using Real = decltype(all[0].x);
        for (const auto& node : nodes)
          all.push_back(vec3_cast<std::remove_reference_t<Real>>(node));
      },
      to, more);
}

std::vector<std::vector<double>> numbers_of(const std::filesystem::path& path,
                                            const CoordinateArrays& arrays,
                                            const PositionsView& positions) {
  std::vector<Place> places;
  places.reserve(arrays.node_count);
  std::visit(
      [&](const auto& nodes) {
        for (const auto& node : nodes.subspan(arrays.first_node, arrays.node_count)) {
          places.push_back(place_of(node));
        }
      },
      positions);
  if (arrays.dimension == 2) check_flat(path, places);
  std::vector<std::vector<double>> numbers(arrays.names.size());
  const bool by_node = numbers.size() == 1 && !arrays.by_axis;
  for (std::size_t axis = 0; axis < arrays.dimension && !by_node; ++axis) {
    std::vector<double>& column = numbers[numbers.size() == 1 ? 0 : axis];
    for (const Place& place : places) column.push_back(place[axis]);
  }
  for (std::size_t node = 0; node < places.size() && by_node; ++node) {
    for (std::size_t axis = 0; axis < arrays.dimension; ++axis) {
      numbers[0].push_back(places[node][axis]);
    }
  }
  return numbers;
}

bool has_moved(const Positions& read, const PositionsView& positions) {
  const auto bits = [](const Place& place) {
    return std::bit_cast<std::array<std::uint64_t, 3>>(place);
  };
  return std::visit(
      [&](const auto& before, const auto& now) {
        return !std::ranges::equal(before, now, [&](const auto& a, const auto& b) {
          return bits(place_of(a)) == bits(place_of(b));
        });
      },
      read, positions);
}

void write_hdf5(const std::filesystem::path& path, const std::string& bytes, const MeshFile& file) {
  const FileContent& content = *file.content();
  write_bytes(path, bytes);
  const PositionsView positions = file.mesh.positions_view();
  if (!has_moved(content.dataset->positions(), positions)) return;
  Hdf5File changed(path);
  for (const CoordinateArrays& arrays : content.arrays) {
    const auto numbers = numbers_of(path, arrays, positions);
    for (std::size_t array = 0; array < numbers.size(); ++array) {
      changed.overwrite(arrays.names[array], numbers[array]);
    }
  }
  changed.close();
}

void write_hdf5(const std::filesystem::path& path, const MeshFile& file) {
  write_hdf5(path, file.content()->text, file);
}

}  // namespace meshsmooth::formats
