#include <system_error>

#include "content.hpp"
#include "deck_parser.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// The deck without its directives: one file that needs no other.
std::string inlined(const FileContent& content, const Mesh& mesh) {
  std::string text;
  std::size_t last = 0;
  for (const TextSegment& segment : content.segments) {
    if (segment.directive) continue;
    if (segment.file != last && !text.empty() && !text.ends_with('\n')) text += '\n';
    last = segment.file;
    text += replace_coordinates(segment, mesh);
  }
  return text;
}

/// Over itself: every file that holds coordinates.
void write_files(const FileContent& content, const Mesh& mesh, OutputFiles& files) {
  for (std::size_t file = 0; file < content.files.size(); ++file) {
    std::string text;
    bool holds_nodes = file == 0;
    for (const TextSegment& segment : content.segments) {
      if (segment.file != file) continue;
      holds_nodes = holds_nodes || !segment.nodes.empty();
      text += replace_coordinates(segment, mesh);
    }
    if (holds_nodes) write_bytes(files.add(content.files[file]), text);
  }
}

}  // namespace

MeshFile read_abaqus(const path& file) {
  FileContent content;
  content.extension = ".inp";
  read_deck(file, content);
  return make_mesh_file(file, std::move(content));
}

void write_abaqus(const path& target, const MeshFile& file, OutputFiles& files) {
  const auto& content = file.content();
  if (content && content->extension == ".inp") {
    std::error_code error;
    if (std::filesystem::equivalent(target, content->files.front(), error)) {
      write_files(*content, file.mesh, files);
    } else {
      write_bytes(files.add(target), inlined(*content, file.mesh));
    }
    return;
  }
#if defined(MESHSMOOTH_WITH_GMSH)
  write_gmsh(files.add(target), file);
#else
  fail("FORMAT_UNKNOWN", target,
       "cannot turn another format into \".inp\": this build is without Gmsh");
#endif
}

}  // namespace meshsmooth::formats
