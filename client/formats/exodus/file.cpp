#include <set>
#include <utility>

#include "classic_header.hpp"
#include "content.hpp"
#include "exodus/blocks.hpp"
#include "exodus/sets.hpp"
#include "hdf5_file.hpp"
#include "netcdf_file.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// The file's own numbers, unless two are the same; then they count from 1.
std::vector<std::int64_t> read_map(const NetcdfFile& file, const std::string& variable,
                                   std::size_t count) {
  std::vector<std::int64_t> ids;
  if (file.has(variable)) ids = file.integers(variable);
  if (ids.size() == count && std::set<std::int64_t>(ids.begin(), ids.end()).size() == count) {
    return ids;
  }
  ids.resize(count);
  for (std::size_t place = 0; place < count; ++place) {
    ids[place] = static_cast<std::int64_t>(place) + 1;
  }
  return ids;
}

void read_nodes(const NetcdfFile& file, const path& path, FileContent& content,
                PlainDataset& dataset) {
  CoordinateArrays arrays;
  arrays.dimension = file.dimension("num_dim").value_or(0);
  if (file.has("coord")) {
    arrays.names = {"coord"};
  } else {
    for (const char* name : {"coordx", "coordy", "coordz"}) {
      if (arrays.names.size() < arrays.dimension) arrays.names.emplace_back(name);
    }
  }
  if (arrays.names.empty()) file.fail("there are no coordinates in it: \"num_dim\" is missing");
  std::vector<std::vector<double>> numbers;
  arrays.single_precision = true;
  for (const std::string& name : arrays.names) {
    numbers.push_back(file.reals(name));
    arrays.single_precision = arrays.single_precision && file.is_single_precision(name);
  }
  dataset.set_positions(positions_of(path, arrays, numbers));
  if (static_cast<std::size_t>(dataset.node_count()) != file.dimension("num_nodes")) {
    file.fail("its coordinates are not those of \"num_nodes\" nodes");
  }
  arrays.node_count = static_cast<std::size_t>(dataset.node_count());
  content.arrays.push_back(std::move(arrays));
  content.node_ids = read_map(file, "node_num_map", static_cast<std::size_t>(dataset.node_count()));
}

}  // namespace

MeshFile read_exodus(const path& path) {
  FileContent content;
  content.extension = ".exo";
  content.text = read_bytes(path);
  if (content.text.starts_with("\x89HDF")) {
    // netCDF lists the variables in a way that crashes HDF5 1.10 where the list is damaged.
    const Hdf5File objects(path, content.text);
    (void)objects.children("/");
    objects.check_own_data();  // netCDF would follow
  }
  check_classic_header(path, content.text);
  const NetcdfFile file(path, NetcdfFile::Access::read);
  const auto dataset = std::make_shared<PlainDataset>();
  read_nodes(file, path, content, *dataset);
  const ExodusMesh mesh = read_exodus_blocks(file, path, content.arrays.front().dimension);
  add_exodus_cells(mesh, content, *dataset);
  content.cell_ids =
      read_map(file, "elem_num_map", static_cast<std::size_t>(dataset->cell_count()));
  read_exodus_sets(file, mesh, dataset->node_count(), content);
  content.dataset = dataset;
  return make_mesh_file(path, std::move(content));
}

void write_exodus(const path& path, const MeshFile& mesh_file) {
  const FileContent& content = *mesh_file.content();
  write_bytes(path, content.text);
  const PositionsView positions = mesh_file.mesh.positions_view();
  if (!has_moved(content.dataset->positions(), positions)) return;
  const CoordinateArrays& arrays = content.arrays.front();
  const auto numbers = numbers_of(path, arrays, positions);
  NetcdfFile file(path, NetcdfFile::Access::change);
  for (std::size_t array = 0; array < numbers.size(); ++array) {
    file.overwrite(arrays.names[array], numbers[array]);
  }
  file.close();
}

}  // namespace meshsmooth::formats
