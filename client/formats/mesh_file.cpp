#include "mesh_file.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "content.hpp"
#include "file_bytes.hpp"
#include "format_lookup.hpp"
#include "output_target.hpp"
#include "staged_file.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// Folders of a case are made where they miss.
void check_case_writable(const path& file) {
  path folder = poly_mesh_folder(file);
  check_replaceable(folder / "points");
  if (extension_of(file) == ".foam") check_replaceable(file);
  std::error_code error;
  while (!std::filesystem::exists(folder, error) && folder.has_relative_path()) {
    folder = folder.has_parent_path() ? folder.parent_path() : path(".");
  }
  if (!std::filesystem::is_directory(folder, error)) {
    fail("FILE_NOT_WRITABLE", file, folder.string() + " is no folder");
  }
  check_folder(file, folder);
}

/// Only VTK's data sets and the format read keep the faces of polyhedra.
void check_polyhedra(const path& file, const Format& format, const MeshFile& content) {
  const auto held = std::ranges::find(content.held_cells(), kPolyhedronCell, &HeldCells::cell_type);
  if (held == content.held_cells().end()) return;
  if (content.content()->extension == format.extension) return;
  if (dynamic_cast<const PlainDataset*>(content.content()->dataset.get()) == nullptr) return;
  fail("ELEMENT_NOT_SUPPORTED", file,
       "\"" + std::string(format.extension) + "\" files cannot carry the " +
           std::to_string(held->count) + " polyhedra of the mesh");
}

}  // namespace

MeshFile::MeshFile(Mesh mesh_of_file, std::shared_ptr<const FileContent> content)
    : mesh(std::move(mesh_of_file)), content_(std::move(content)) {}

std::int64_t MeshFile::file_element_id(std::int64_t element) const {
  if (!content_) return element;
  const std::int64_t cell = content_->element_cells.at(static_cast<std::size_t>(element));
  return content_->cell_ids.empty() ? cell : content_->cell_ids[static_cast<std::size_t>(cell)];
}

std::int64_t MeshFile::file_node_id(std::int64_t node) const {
  if (!content_ || content_->node_ids.empty()) return node;
  return content_->node_ids.at(static_cast<std::size_t>(node));
}

std::optional<NodeId> MeshFile::find_node(std::int64_t file_id) const {
  if (!content_ || content_->node_ids.empty()) {
    if (file_id < 0 || static_cast<std::size_t>(file_id) >= mesh.node_count()) return std::nullopt;
    return static_cast<NodeId>(file_id);
  }
  const auto& order = content_->nodes_by_id;
  const auto found =
      std::lower_bound(order.begin(), order.end(), file_id, [&](NodeId node, std::int64_t id) {
        return content_->node_ids[static_cast<std::size_t>(node)] < id;
      });
  if (found == order.end() || file_node_id(*found) != file_id) return std::nullopt;
  return *found;
}

const std::vector<NodeId>& MeshFile::lower_dimensional_nodes() const {
  static const std::vector<NodeId> none;
  return content_ ? content_->lower_dimensional_nodes : none;
}

std::int64_t MeshFile::lower_dimensional_cell_count() const {
  return content_ ? content_->lower_dimensional_cell_count : 0;
}

const std::vector<HeldCells>& MeshFile::held_cells() const {
  static const std::vector<HeldCells> none;
  return content_ ? content_->held_cells : none;
}

const std::vector<NodePair>& MeshFile::node_pairs() const {
  static const std::vector<NodePair> none;
  return content_ ? content_->node_pairs : none;
}

const std::vector<std::string>& MeshFile::notes() const {
  static const std::vector<std::string> none;
  return content_ ? content_->notes : none;
}

MeshFile read_mesh_file(const path& given, const std::string& named) {
  const path file = is_standard_input(given) ? path(kStandardStream) : given;
  std::error_code error;
  if (file != kStandardStream && !std::filesystem::exists(file, error)) {
    fail("FILE_NOT_FOUND", file, "there is no such file");
  }
  const Format& format = readable_format(file, named);
  if (file != kStandardStream && ::access(file.c_str(), R_OK) != 0) {
    fail("FILE_NOT_READABLE", file, std::strerror(errno));
  }
  if (!format.is_case && std::filesystem::is_regular_file(file, error) &&
      std::filesystem::file_size(file, error) == 0) {
    fail("FILE_TRUNCATED", file, "the file is empty");
  }
  // Formats of several files look for the others beside this one, and read by `read_bytes`.
  const bool in_place = format.write_all != nullptr || is_plain(file, format);
  return in_place ? format.read(file) : read_staged(file, format);
}

void check_writable(const path& file, const path& source, const std::string& named) {
  if (writable_format(file, named, source).is_case) {
    check_case_writable(file);
  } else {
    check_output(file);
  }
}

void check_writable_with_arrays(const path& file, const path& source, const std::string& named) {
  const Format& format = writable_format(file, named, source);
  if (!format.cell_arrays) {
    fail("ARRAYS_NOT_SUPPORTED", file,
         "\"" + std::string(format.extension) +
             "\" files are written without cell arrays; with them are " + array_extensions());
  }
  check_writable(file, source, named);
}

void write_mesh_file(const path& file, const MeshFile& content, const std::string& named) {
  const path source = content.content() ? content.content()->extension : "";
  if (content.element_quality.metrics.empty() && content.element_arrays.empty()) {
    check_writable(file, source, named);
  } else {
    check_writable_with_arrays(file, source, named);
  }
  check_node_count(content);
  const Format& format = writable_format(file, named, source);
  check_polyhedra(file, format, content);
  OutputFiles files(file, std::string(format.extension));
  try {
    if (format.write_all != nullptr) {
      format.write_all(file, content, files);
    } else {
      format.write(files.add(file), content);
    }
    files.commit();
  } catch (const Error& failure) {  // say the caller's name of the file
    const path name = output_name(file);
    std::string text = files.with_caller_names(failure.what());
    if (text.starts_with(name.string() + ": ")) text.erase(0, name.string().size() + 2);
    fail(failure.reason(), name, text);
  }
}

}  // namespace meshsmooth::formats
