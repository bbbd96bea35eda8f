#include <filesystem>

#include "content.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// Throws where OpenFOAM would read an uncompressed file that is there instead of the one written.
void check_not_hidden(const path& written) {
  path plain = written;
  std::error_code error;
  if (written.extension() != ".gz") return;
  if (!std::filesystem::exists(plain.replace_extension(), error)) return;
  fail("FILE_NOT_WRITABLE", written,
       "OpenFOAM would read the old " + plain.filename().string() +
           " beside it instead; remove that first");
}

/// All files of the mesh but its points.
void copy_topology(const path& from, const path& to, const path& points, OutputFiles& files) try {
  for (const auto& entry : std::filesystem::recursive_directory_iterator(from)) {
    const path name = entry.path().lexically_relative(from);
    if (!entry.is_regular_file() || name == points) continue;
    check_not_hidden(to / name);
    std::filesystem::copy_file(entry.path(), files.add_as_it_is(to / name),
                               std::filesystem::copy_options::overwrite_existing);
  }
} catch (const std::filesystem::filesystem_error& error) {
  fail("FILE_NOT_WRITABLE", to, std::string("cannot copy the mesh: ") + error.what());
}

}  // namespace

void write_foam(const path& target, const MeshFile& file, OutputFiles& files) {
  const auto& content = file.content();
  const path folder = poly_mesh_folder(target);
  const path source = content->files.front().parent_path();
  std::error_code error;
  const path points = content->files.front().filename();
  if (!std::filesystem::equivalent(folder, source, error)) {
    copy_topology(source, folder, points, files);
    check_not_hidden(folder / points);
  }
  write_bytes(files.add(folder / points),
              replace_coordinates(content->segments.front(), file.mesh));
  if (extension_of(target) == ".foam" && !std::filesystem::exists(target, error)) {
    write_bytes(files.add(target), "");
  }
}

}  // namespace meshsmooth::formats
