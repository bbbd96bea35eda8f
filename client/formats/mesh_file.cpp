#include "mesh_file.hpp"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <span>

#include "content.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

template <class Has>
std::string extensions(Has has) {
  std::string list;
  for (const Format& format : kFormats) {
    if (!has(format)) continue;
    if (!list.empty()) list += ' ';
    list += format.extension;
  }
  return list;
}

const Format* find_format(const path& file) {
  const auto known = [](const std::string& extension) {
    return std::ranges::find(kFormats, std::string_view(extension), &Format::extension);
  };
  const auto* found = known(extension_of(file));
  if (found == kFormats.end() && !poly_mesh_folder(file).empty()) found = known(".foam");
  return found == kFormats.end() ? nullptr : found;
}

[[noreturn]] void fail_unknown(const path& file, const Format* format, const std::string& what,
                               const std::string& known) {
  const std::string missing = format == nullptr || format->library.empty()
                                  ? ""
                                  : ": this build is without " + std::string(format->library);
  fail("FORMAT_UNKNOWN", file,
       "cannot " + what + " \"" + extension_of(file) + "\" files" + missing + "; known are " +
           known);
}

const Format& writable_format(const path& file) {
  const Format* format = find_format(file);
  if (format == nullptr || !format->is_written()) {
    fail_unknown(file, format, "write", writable_extensions());
  }
  return *format;
}

/// Throws FORMAT_UNKNOWN where the format is written from its own files only and `source`, a
/// file's name or extension, is none of them.
void check_source(const path& file, const path& source) {
  const Format& format = writable_format(file);
  if (!format.only_changed) return;
  const bool is_extension = source.native().starts_with('.') && !source.has_extension();
  const Format* read = find_format(source);
  if (read == nullptr && is_extension) read = find_format(path("x") += source);
  if (read != nullptr && read->read == format.read) return;
  fail(
      "FORMAT_UNKNOWN", file,
      "\"" + std::string(format.extension) +
          "\" files are written only with the contents of a file of the "
          "same format, of which the coordinates change; written from any are " +
          extensions(
              [](const Format& other) { return other.is_written() && !other.only_changed; }) +
          (format.library.empty() ? "" : "; this build is without " + std::string(format.library)));
}

/// Throws unless the file can be replaced, or made where there is none.
void check_replaceable(const path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) return;
  if (!std::filesystem::is_regular_file(status)) {
    fail("FILE_NOT_WRITABLE", file, "this is no ordinary file");
  }
  if (::access(file.c_str(), W_OK) != 0) fail("FILE_NOT_WRITABLE", file, std::strerror(errno));
}

void check_folder(const path& file, const path& folder) {
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    fail("FILE_NOT_WRITABLE", file, "folder " + folder.string() + ": " + std::strerror(errno));
  }
}

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

std::string extension_of(const path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return extension;
}

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

const std::vector<std::string>& MeshFile::notes() const {
  static const std::vector<std::string> none;
  return content_ ? content_->notes : none;
}

std::string readable_extensions() {
  return extensions([](const Format& format) { return format.read != nullptr; });
}

std::string writable_extensions() {
  return extensions([](const Format& format) { return format.is_written(); });
}

std::string array_extensions() {
  return extensions([](const Format& format) { return format.cell_arrays; });
}

MeshFile read_mesh_file(const path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) fail("FILE_NOT_FOUND", file, "there is no such file");
  const Format* format = find_format(file);
  const bool is_case = format != nullptr && format->is_case;
  if (std::filesystem::is_directory(file, error) && !is_case) {
    fail("FILE_NOT_READABLE", file, "this is a folder, and no OpenFOAM case");
  }
  if (format == nullptr || format->read == nullptr) {
    fail_unknown(file, format, "read", readable_extensions());
  }
  if (::access(file.c_str(), R_OK) != 0) fail("FILE_NOT_READABLE", file, std::strerror(errno));
  if (!is_case && std::filesystem::file_size(file, error) == 0) {
    fail("FILE_TRUNCATED", file, "the file is empty");
  }
  return format->read(file);
}

void check_writable(const path& file, const path& source) {
  check_source(file, source);
  if (writable_format(file).is_case) {
    check_case_writable(file);
    return;
  }
  check_replaceable(file);
  const path folder = file.has_parent_path() ? file.parent_path() : path(".");
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    fail("FILE_NOT_WRITABLE", file, "there is no folder " + folder.string());
  }
  check_folder(file, folder);
}

void check_writable_with_arrays(const path& file) {
  if (!writable_format(file).cell_arrays) {
    fail("ARRAYS_NOT_SUPPORTED", file,
         "\"" + extension_of(file) + "\" files are written without cell arrays; with them are " +
             array_extensions());
  }
  check_writable(file);
}

void write_mesh_file(const path& file, const MeshFile& content) {
  const std::string source = content.content() ? content.content()->extension : "";
  if (content.element_quality.metrics.empty() && content.element_arrays.empty()) {
    check_writable(file, source);
  } else {
    check_writable_with_arrays(file);
  }
  check_node_count(content);
  const Format& format = writable_format(file);
  check_polyhedra(file, format, content);
  OutputFiles files;
  try {
    if (format.write_all != nullptr) {
      format.write_all(file, content, files);
    } else {
      format.write(files.add(file), content);
    }
    files.commit();
  } catch (const Error& failure) {  // say the caller's name of the file
    std::string text = files.without_partial_name(failure.what());
    if (text.starts_with(file.string() + ": ")) text.erase(0, file.string().size() + 2);
    fail(failure.reason(), file, text);
  }
}

}  // namespace meshsmooth::formats
