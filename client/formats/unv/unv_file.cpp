#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "content.hpp"
#include "readers.hpp"
#include "unv/lines.hpp"
#include "unv/model.hpp"
#include "unv/nodes.hpp"
#include "unv/writer.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

constexpr auto kElementSets = std::to_array<int>({71, 780, 2412});
constexpr auto kGroupSets =
    std::to_array<int>({752, 2417, 2429, 2430, 2432, 2435, 2452, 2467, 2477});

/// Past a data set whose head tells of binary data: their lines of text, then their bytes.
void skip_binary(unv::Lines& lines, const unv::Words& head) {
  const auto line_count = lines.scanner().parse<std::size_t>(head.words[3]);
  const auto byte_count = lines.scanner().parse<std::size_t>(head.words[4]);
  lines.take();
  for (std::size_t line = 0; line < line_count; ++line) {
    if (lines.scanner().position() >= lines.text().size()) lines.scanner().truncated();
    lines.take();
  }
  lines.skip_bytes(byte_count);
}

/// A file that ends in a data set is whole if this ends with a record and every node has elements;
/// else it was probably cut off.
void check_end(const path& file, const unv::Lines& lines, const unv::Model& model) {
  if (!lines.is_unfinished()) return;
  const std::int64_t unused = model.unused_node_count();
  if (lines.text().ends_with('\n') && unused == 0) return;
  fail("FILE_TRUNCATED", file,
       "the last data set does not end with -1" +
           (unused == 0 ? std::string()
                        : ", and " + std::to_string(unused) + " nodes are in no element"));
}

/// The data sets that tell of the mesh; the others are passed over.
void read_data_sets(unv::Lines& lines, unv::Nodes& nodes, unv::Model& model) {
  bool any = false;
  while (lines.next_data_set()) {
    any = true;
    const unv::Words head = unv::split(lines.peek());
    if (head.count >= 5 && head.words[0].ends_with('b')) {
      skip_binary(lines, head);
      while (lines.more()) lines.take();
      continue;
    }
    const auto number = lines.scanner().parse<int>(head.words[0]);
    lines.take();
    if (number == 15) {
      nodes.read_single(lines);
    } else if (number == 781 || number == 2411) {
      nodes.read_double(lines);
    } else if (number == 2420) {
      nodes.read_systems(lines);
    } else if (std::ranges::find(kElementSets, number) != kElementSets.end()) {
      model.read_elements(lines, number);
    } else if (std::ranges::find(kGroupSets, number) != kGroupSets.end()) {
      model.read_groups(lines, number);
    } else {
      while (lines.more()) lines.take();
    }
  }
  if (!any) lines.scanner().refuse("-1, which opens a data set", "");
}

}  // namespace

MeshFile read_unv(const path& file) {
  FileContent content;
  content.extension = ".unv";
  std::string text = read_bytes(file);
  unv::Lines lines(file, text);
  unv::Nodes nodes(file);
  unv::Model model(file);
  read_data_sets(lines, nodes, model);
  nodes.check_systems();
  CoordinateFields fields = nodes.take_fields();
  content.node_ids = fields.node_ids;
  const auto dataset = std::make_shared<PlainDataset>();
  dataset->set_positions(fields.positions);
  model.store(content, *dataset);
  check_end(file, lines, model);
  content.dataset = dataset;
  content.segments.push_back(whole_file(std::move(text), std::move(fields)));
  return make_mesh_file(file, std::move(content));
}

void write_unv(const path& file, const MeshFile& mesh_file) {
  const auto& content = mesh_file.content();
  if (content && content->extension == ".unv") {
    write_bytes(file, replace_coordinates(content->segments.front(), mesh_file.mesh));
  } else {
    write_bytes(file, unv::make_text(file, mesh_file));
  }
}

}  // namespace meshsmooth::formats
