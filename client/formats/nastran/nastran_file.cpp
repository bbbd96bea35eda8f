#include <algorithm>
#include <array>
#include <system_error>

#include "content.hpp"
#include "nastran/cards.hpp"
#include "nastran/coordinate_writer.hpp"
#include "nastran/deck_writer.hpp"
#include "nastran/model.hpp"
#include "nastran/numbers.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// Reads the cards that tell of the mesh, into the model.
class BulkDataParser final : public NastranControl {
 public:
  explicit BulkDataParser(const path& file) : lines_(file), model_(lines_) {}

  void parse() {
    NastranCards cards(lines_, *this);
    NastranCard card;
    while (cards.next(card)) {
      for (const std::string_view comment : card.comments) names_.read_comment(comment);
      read_card(card);
    }
    for (const std::string_view comment : lines_.comments()) names_.read_comment(comment);
  }

  MeshFile store(const path& file) {
    FileContent content;
    content.extension = ".bdf";  // whatever the deck is called
    model_.store(names_, content);
    lines_.store(content, model_.node_of_grid());
    MeshFile mesh_file = make_mesh_file(file, std::move(content));
    for (const NodeId node : model_.system_nodes()) {  // what else is defined there must not turn
      mesh_file.mesh.fixed.resize(mesh_file.mesh.node_count(), 0);
      mesh_file.mesh.fixed[static_cast<std::size_t>(node)] = 1;
    }
    return mesh_file;
  }

  void read_control_line(const NastranLine& line) override { names_.read_control_line(line); }

  void begin_section(std::string_view what) override {
    const bool main = what.find_first_of("=") == std::string_view::npos;
    model_.enter_scope(main ? std::string() : std::string(what));
  }

 private:
  void read_card(NastranCard& card) {
    const std::string& name = card.name;
    if (name == "GRID") {
      model_.add_grid(card);
    } else if (name == "GRDSET") {
      model_.add_grid_defaults(card);
    } else if (name == "SET1" || name == "SET3") {
      if (!names_.read_set(card)) lines_.refuse(card.line(), "the ids of a set", card.line().text);
    } else if (name.starts_with('P') && name != "PLOTEL") {
      read_property(card);
    } else if (name.starts_with('C') && model_.add_system(card)) {
      return;
    } else if (const NastranElement* type = find_nastran_element(name)) {
      if (type->role != NastranElement::Role::no_nodes) model_.add_element(card, *type);
    } else if (name.starts_with('C') && !is_other_nastran_card(name)) {
      model_.add_unknown(card);
    }
  }

  /// The cards that have their one material behind the id.
  void read_property(const NastranCard& card) {
    constexpr auto kWithMaterial =
        std::to_array<std::string_view>({"PSHELL", "PSOLID", "PLSOLID", "PLPLANE", "PSHEAR", "PBAR",
                                         "PBARL", "PBEAM", "PBEAML", "PROD", "PTUBE"});
    const auto id = parse_nastran_integer(card.field(0));
    if (!id) return;
    names_.read_property(*id);
    if (std::ranges::find(kWithMaterial, card.name) == kWithMaterial.end()) return;
    if (const auto material = parse_nastran_integer(card.field(1))) {
      model_.add_material(*id, *material);
    }
  }

  NastranLines lines_;
  NastranModel model_;
  NastranNames names_;
};

/// As they stand in the text.
std::vector<Vec3d> written_positions(const path& target, const FileContent& content,
                                     const Mesh& mesh) {
  std::vector<Vec3d> now;
  const auto gather = [&](const auto& positions) {
    now.reserve(positions.size());
    for (const auto& position : positions) now.push_back(vec3_cast<double>(position));
  };
  std::visit(gather, mesh.positions);
  if (!content.systems) return now;
  const Positions read = content.dataset->positions();
  const CoordinateSystems& systems = *content.systems;
  return systems.local_positions(
      std::get<std::vector<Vec3d>>(read), now, [&](std::size_t system, const char* why) {
        fail("FORMAT_ERROR", target,
             "with the nodes where they are now the coordinate system " +
                 std::to_string(systems.systems[system].definition.id) + " " + why);
      });
}

/// The deck without its directives: one file that needs no other.
std::string inlined(const FileContent& content, const std::vector<Vec3d>& positions) {
  std::string text;
  std::size_t last = 0;
  for (const TextSegment& segment : content.segments) {
    if (segment.directive) continue;
    if (segment.file != last && !text.empty() && !text.ends_with('\n')) text += '\n';
    last = segment.file;
    text += replace_nastran_coordinates(segment, positions);
  }
  return text;
}

/// Over itself: every file that holds coordinates.
void write_files(const FileContent& content, const std::vector<Vec3d>& positions,
                 OutputFiles& files) {
  for (std::size_t file = 0; file < content.files.size(); ++file) {
    std::string text;
    bool holds_nodes = file == 0;
    for (const TextSegment& segment : content.segments) {
      if (segment.file != file) continue;
      holds_nodes = holds_nodes || !segment.nodes.empty();
      text += replace_nastran_coordinates(segment, positions);
    }
    if (holds_nodes) write_bytes(files.add(content.files[file]), text);
  }
}

}  // namespace

MeshFile read_nastran(const path& file) {
  BulkDataParser parser(file);
  parser.parse();
  return parser.store(file);
}

void write_nastran(const path& target, const MeshFile& file, OutputFiles& files) {
  const auto& content = file.content();
  const bool nastran = content && content->extension == ".bdf";
  if (!nastran) {
    write_bytes(files.add(target), make_nastran(target, file));
    return;
  }
  const std::vector<Vec3d> positions = written_positions(target, *content, file.mesh);
  std::error_code error;
  if (std::filesystem::equivalent(target, content->files.front(), error)) {
    write_files(*content, positions, files);
  } else {
    write_bytes(files.add(target), inlined(*content, positions));
  }
}

}  // namespace meshsmooth::formats
