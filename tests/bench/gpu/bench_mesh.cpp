#include "gpu/bench_mesh.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <numeric>
#include <random>
#include <stdexcept>

#include "generate/generate.hpp"
#include "generate/random.hpp"

namespace meshsmooth::bench {
namespace {

constexpr std::uint64_t kSeed = 1;
constexpr std::array<char, 8> kMagic = {'M', 'S', 'B', 'E', 'N', 'C', 'H', '1'};

template <class T>
void write_array(std::ostream& out, const std::vector<T>& array) {
  const std::uint64_t size = array.size();
  out.write(reinterpret_cast<const char*>(&size), sizeof(size));
  out.write(reinterpret_cast<const char*>(array.data()),
            static_cast<std::streamsize>(size * sizeof(T)));
}

template <class T>
bool read_array(std::istream& in, std::vector<T>& array) {
  std::uint64_t size = 0;
  if (!in.read(reinterpret_cast<char*>(&size), sizeof(size))) return false;
  array.resize(size);
  return static_cast<bool>(in.read(reinterpret_cast<char*>(array.data()),
                                   static_cast<std::streamsize>(size * sizeof(T))));
}

bool read_cached(const std::filesystem::path& file, BenchMesh& mesh) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return false;
  std::array<char, 8> magic{};
  if (!in.read(magic.data(), magic.size()) || magic != kMagic || !read_array(in, mesh.positions) ||
      !read_array(in, mesh.tetrahedra)) {
    throw std::runtime_error(file.string() + ": not a mesh of this cache; delete it");
  }
  return true;
}

void write_cached(const std::filesystem::path& file, const BenchMesh& mesh) {
  std::filesystem::create_directories(file.parent_path());
  // Whoever reads sees a whole file or none.
  const std::filesystem::path part = file.string() + ".part";
  {
    std::ofstream out(part, std::ios::binary);
    out.write(kMagic.data(), kMagic.size());
    write_array(out, mesh.positions);
    write_array(out, mesh.tetrahedra);
    if (!out.flush()) throw std::runtime_error(part.string() + ": cannot be written");
  }
  std::filesystem::rename(part, file);
}

using Generator = Mesh (*)(std::size_t, std::uint64_t, double);

BenchMesh make(const std::string& shape, Generator generate, std::size_t node_count,
               const std::filesystem::path& cache) {
  BenchMesh mesh;
  const std::filesystem::path file =
      cache / (shape + "-" + std::to_string(node_count) + "-seed1.mesh");
  if (!cache.empty() && read_cached(file, mesh)) return mesh;
  std::cerr << "making the " << shape << " with " << node_count << " nodes" << std::endl;
  Mesh made = generate(node_count, kSeed, 0);
  mesh.positions = std::move(std::get<std::vector<Vec3d>>(made.positions));
  mesh.tetrahedra = std::move(made.blocks.front().nodes);
  if (!cache.empty()) write_cached(file, mesh);
  return mesh;
}

/// The six paths along the axes from a cell's lowest to its highest corner; each
/// makes a tetrahedron, every second one in the wrong orientation.
constexpr std::array<std::array<int, 3>, 6> kAxisOrders = {
    {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
constexpr int kEvenOrders = 3;

}  // namespace

std::vector<Vec3f> BenchMesh::float_positions() const {
  std::vector<Vec3f> result(positions.size());
  std::transform(positions.begin(), positions.end(), result.begin(), vec3_cast<float, double>);
  return result;
}

BenchMesh make_cube(std::size_t node_count, const std::filesystem::path& cache) {
  BenchMesh mesh = make("cube", formats::generate_cube, node_count, cache);
  mesh.name = short_count(node_count);
  return mesh;
}

BenchMesh make_slope(std::size_t node_count, const std::filesystem::path& cache) {
  BenchMesh mesh = make("slope", formats::generate_slope, node_count, cache);
  mesh.name = "slope" + short_count(node_count);
  return mesh;
}

BenchMesh make_grid(int side, NodeOrder order) {
  constexpr double kJitter = 0.15;  // of the spacing; no tetrahedron is inverted
  const auto count = static_cast<std::size_t>(side) * side * side;
  std::vector<NodeId> id(count);
  std::iota(id.begin(), id.end(), 0);
  if (order == NodeOrder::permuted) {
    std::mt19937_64 engine(kSeed);
    for (std::size_t last = count - 1; last > 0; --last) {
      std::swap(id[last], id[engine() % (last + 1)]);
    }
  }

  BenchMesh mesh;
  mesh.name = "grid" + std::to_string(side) + (order == NodeOrder::permuted ? "-permuted" : "");
  mesh.positions.resize(count);
  const double spacing = 1.0 / (side - 1);
  formats::Random random(kSeed);
  std::size_t node = 0;
  const auto inner = [&](int index) { return index > 0 && index < side - 1; };
  for (int k = 0; k < side; ++k) {
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i, ++node) {
        Vec3d place = {spacing * i, spacing * j, spacing * k};
        if (inner(i) && inner(j) && inner(k)) place += random.vector(kJitter * spacing);
        mesh.positions[static_cast<std::size_t>(id[node])] = place;
      }
    }
  }

  const std::array<std::size_t, 3> step = {1, static_cast<std::size_t>(side),
                                           static_cast<std::size_t>(side) * side};
  const auto cells = static_cast<std::size_t>(side - 1);
  mesh.tetrahedra.reserve(24 * cells * cells * cells);
  for (std::size_t k = 0; k < cells; ++k) {
    for (std::size_t j = 0; j < cells; ++j) {
      for (std::size_t i = 0; i < cells; ++i) {
        const std::size_t lowest = i * step[0] + j * step[1] + k * step[2];
        for (int o = 0; o < 6; ++o) {
          const auto& axes = kAxisOrders[o];
          std::array<std::size_t, 4> corner = {lowest, 0, 0, 0};
          for (int c = 0; c < 3; ++c) corner[c + 1] = corner[c] + step[axes[c]];
          if (o >= kEvenOrders) std::swap(corner[1], corner[2]);
          for (const std::size_t c : corner) mesh.tetrahedra.push_back(id[c]);
        }
      }
    }
  }
  return mesh;
}

std::string short_count(std::size_t count) {
  if (count >= 1'000'000 && count % 1'000'000 == 0) return std::to_string(count / 1'000'000) + "M";
  if (count >= 1000 && count % 1000 == 0) return std::to_string(count / 1000) + "k";
  return std::to_string(count);
}

}  // namespace meshsmooth::bench
