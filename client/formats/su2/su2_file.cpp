#include "content.hpp"
#include "parser.hpp"
#include "plane.hpp"
#include "readers.hpp"
#include "text.hpp"
#include "writer.hpp"

namespace meshsmooth::formats {

using std::filesystem::path;

MeshFile read_su2(const path& file) {
  FileContent content;
  content.extension = ".su2";
  std::string text = read_bytes(file);
  if (text.find('\0') != std::string::npos)
    fail("FORMAT_ERROR", file, "not a text file: it contains NUL bytes");
  Su2Parser parser(file, text);
  parser.parse();
  parser.store(content);
  CoordinateFields fields = parser.take_fields();
  content.segments.push_back(whole_file(std::move(text), std::move(fields)));
  return make_mesh_file(file, std::move(content));
}

void write_su2(const path& file, const MeshFile& mesh_file) {
  const auto& content = mesh_file.content();
  if (!content || content->extension != ".su2") {
    write_bytes(file, make_su2(file, mesh_file));
    return;
  }
  const TextSegment& segment = content->segments.front();
  if (segment.fields.fields.front()[2].length == 0) check_plane(file, mesh_file.mesh);
  write_bytes(file, replace_coordinates(segment, mesh_file.mesh));
}

}  // namespace meshsmooth::formats
