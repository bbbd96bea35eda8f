#include "content.hpp"
#include "medit/model.hpp"
#include "plane.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {

using std::filesystem::path;

MeshFile read_medit(const path& file) {
  FileContent content;
  content.extension = extension_of(file);
  std::string bytes = read_bytes(file);
  medit::Model model;
  if (medit::is_binary(bytes)) {
    medit::read_binary(file, bytes, model);
  } else {
    medit::read_text(file, bytes, model);
  }
  medit::store(file, model, content);
  content.segments.push_back(whole_file(std::move(bytes), std::move(model.fields)));
  return make_mesh_file(file, std::move(content));
}

void write_medit(const path& file, const MeshFile& mesh_file) {
  const auto& content = mesh_file.content();
  if (content && content->extension == extension_of(file)) {
    const TextSegment& segment = content->segments.front();
    if (segment.fields.fields.front()[2].length == 0) check_plane(file, mesh_file.mesh);
    write_bytes(file, replace_coordinates(segment, mesh_file.mesh));
  } else if (extension_of(file) == ".meshb") {
    write_bytes(file, medit::make_binary(file, mesh_file));
  } else {
    write_bytes(file, medit::make_text(file, mesh_file));
  }
}

}  // namespace meshsmooth::formats
