#include <algorithm>
#include <array>
#include <system_error>

#include "abaqus_model.hpp"
#include "cells.hpp"
#include "content.hpp"
#include "deck_reader.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// Keywords by which Abaqus makes nodes or elements that are in no line of the deck.
constexpr auto kGenerators =
    std::to_array<std::string_view>({"NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY",
                                     "SYMMETRICMODELGENERATION", "SUBSTRUCTURE"});

/// Reads the keywords that tell of the mesh, into the model.
class DeckParser {
 public:
  explicit DeckParser(const path& file) : reader_(file) {}

  void parse() {
    bool more = reader_.next();
    if (more && !reader_.at_keyword()) reader_.refuse("a keyword, which starts with *", line());
    while (more) {
      if (!reader_.at_keyword()) {
        more = reader_.next();
        continue;
      }
      more = read_keyword(reader_.keyword());
    }
    if (!part_.empty()) reader_.truncated("without *END PART");
  }

  void store(FileContent& content) {
    const auto dataset = model_.store(reader_, content);
    reader_.store(content);
    std::vector<Vec3d> positions;
    for (const TextSegment& segment : content.segments) {
      const auto& read = segment.fields.positions;
      positions.insert(positions.end(), read.begin(), read.end());
    }
    dataset->set_positions(std::move(positions));
    content.dataset = dataset;
  }

 private:
  using Kind = AbaqusModel::Kind;

  [[nodiscard]] std::string_view line() const { return reader_.line(); }

  /// Moves past it and the data lines that it needs; false at the end of the deck.
  bool read_keyword(const DeckKeyword& keyword) {
    const std::string& name = keyword.name;
    if (name == "NODE" || name == "ELEMENT") {
      reader_.read_input_of(keyword);
      return name == "NODE" ? read_nodes(keyword) : read_elements(keyword);
    }
    if (name == "NSET" || name == "ELSET") {
      return read_set(keyword, name == "NSET" ? Kind::nodes : Kind::elements);
    }
    if (name == "SYSTEM") return read_system(keyword);
    if (name.ends_with("SECTION")) read_section(keyword);
    if (name == "PART") enter_part(keyword);
    if (name == "INSTANCE") enter_instance(keyword);
    if (name == "ENDPART") leave_part();
    if (name == "ENDINSTANCE") leave_part();
    if (std::ranges::find(kGenerators, name) != kGenerators.end()) {
      reader_.fail_at(keyword.place, "*" + name +
                                         " makes nodes or elements that are not in the deck; "
                                         "write them out");
    }
    return reader_.next();
  }

  // --- nodes and elements

  bool read_nodes(const DeckKeyword& keyword) {
    const std::string system = in_capitals(keyword.value("SYSTEM"));
    if (!system.empty() && system != "R") {
      reader_.fail_at(keyword.place, "expected rectangular coordinates, found SYSTEM=" + system);
    }
    const std::string set = keyword.value("NSET");
    if (!set.empty()) model_.add_set(scope_, Kind::nodes, set);
    while (true) {
      if (!reader_.next()) return false;
      if (reader_.at_keyword()) return true;
      if (in_local_system_) {
        reader_.refuse("nodes in the global system, not in that of *SYSTEM", "");
      }
      split_data(line(), words_);
      const std::int64_t label = reader_.label(words_.front());
      std::array<std::string_view, 3> coordinates{};
      for (std::size_t axis = 0; axis < 3 && axis + 1 < words_.size(); ++axis) {
        coordinates[axis] = words_[axis + 1];
      }
      const NodeId node = model_.node_count();
      if (!model_.add_node(scope_, label, set)) {
        reader_.refuse("each node once", words_.front());
      }
      reader_.add_node(node, label, coordinates);
    }
  }

  bool read_elements(const DeckKeyword& keyword) {
    const std::string type = in_capitals(keyword.value("TYPE"));
    if (type.empty()) reader_.fail_at(keyword.place, "expected TYPE=, the type of the elements");
    const std::optional<AbaqusElement> known = find_abaqus_element(type);
    const std::string set = keyword.value("ELSET");
    if (!set.empty()) model_.add_set(scope_, Kind::elements, set);
    std::vector<std::int64_t> nodes;
    while (true) {
      if (!reader_.next()) return false;
      if (reader_.at_keyword()) return true;
      const DeckPlace place = reader_.place();
      split_data(line(), words_);
      const std::int64_t label = reader_.label(words_.front());
      if (!known) {
        reader_.fail_at(place,
                        "element " + std::to_string(label) + " is of the type " + type + "; " +
                            kSupportedElements,
                        "ELEMENT_NOT_SUPPORTED");
      }
      read_corners(label, *known, nodes);
      if (!model_.add_element(scope_, label, *known, nodes, set, place)) {
        reader_.fail_at(place,
                        "expected each element once, found " + std::to_string(label) + " again");
      }
    }
  }

  /// The rest of an element whose first line is in `words_`.
  void read_corners(std::int64_t label, const AbaqusElement& type,
                    std::vector<std::int64_t>& nodes) {
    nodes.clear();
    const auto count = static_cast<std::size_t>(type.node_count);
    std::size_t word = 1;
    while (count == 0 || nodes.size() < count) {
      for (; word < words_.size() && (count == 0 || nodes.size() < count); ++word) {
        const std::string_view number = trimmed(words_[word]);
        if (count == 0 && (number.empty() || number == "0")) continue;  // the ground
        nodes.push_back(read_corner(number));
      }
      if (count == 0 || nodes.size() == count) break;
      const std::string so_far = "element " + std::to_string(label) + " has " +
                                 std::to_string(nodes.size()) + " of its " + std::to_string(count) +
                                 " nodes";
      const DeckPlace place = reader_.place();
      if (!reader_.next())
        reader_.fail_at(place, "the deck ends where " + so_far, "FILE_TRUNCATED");
      if (reader_.at_keyword()) reader_.fail_at(place, so_far);
      split_data(line(), words_);
      word = 0;
    }
    if (nodes.empty()) reader_.refuse("the nodes of an element", line());
    if (word < words_.size() && type.vtk_type != kLineCell && type.vtk_type != kEdge3Cell) {
      reader_.refuse(
          "only the " + std::to_string(count) + " nodes of element " + std::to_string(label),
          words_[word]);
    }
  }

  /// A label, or a node of an instance: "wing-1.12".
  std::int64_t read_corner(std::string_view word) const {
    const std::size_t point = word.rfind('.');
    if (point == std::string_view::npos) return reader_.label(word);
    const auto* instance = model_.find_instance(word.substr(0, point));
    if (instance == nullptr) return reader_.label(word);
    const auto corner = model_.find_corner(*instance, reader_.label(word.substr(point + 1)));
    if (!corner) reader_.refuse("a node of the instance", word);
    return *corner;
  }

  // --- sets and sections

  bool read_set(const DeckKeyword& keyword, Kind kind) {
    const std::string name = keyword.value(kind == Kind::nodes ? "NSET" : "ELSET");
    if (name.empty()) reader_.fail_at(keyword.place, "expected the name of the set");
    AbaqusModel::ScopeId scope = scope_;
    if (const std::string instance = keyword.value("INSTANCE"); !instance.empty()) {
      const auto* known = model_.find_instance(instance);
      if (known == nullptr) {
        reader_.fail_at(keyword.place, "there is no instance \"" + instance + "\"");
      }
      scope = *known;
    }
    model_.add_set(scope_, kind, name);
    const std::string elements = keyword.value("ELSET");
    if (kind == Kind::nodes && !elements.empty()) {
      model_.add_to_set(scope_, kind, name,
                        {Kind::elements, scope, false, {}, elements, keyword.place});
    }
    const bool generate = keyword.find("GENERATE") != nullptr;
    while (true) {
      if (!reader_.next()) return false;
      if (reader_.at_keyword()) return true;
      split_data(line(), words_);
      if (generate) {
        model_.add_to_set(scope_, kind, name,
                          {kind, scope, true, read_range(), {}, reader_.place()});
        continue;
      }
      for (const std::string_view word : words_) {
        if (!trimmed(word).empty()) {
          model_.add_to_set(scope_, kind, name, read_member(trimmed(word), kind, scope));
        }
      }
    }
  }

  /// "first, last[, step]".
  AbaqusModel::Range read_range() {
    const std::int64_t first = reader_.label(words_.front());
    const std::int64_t last = words_.size() > 1 ? reader_.label(words_[1]) : first;
    const std::int64_t step = words_.size() > 2 ? reader_.label(words_[2]) : 1;
    if (last < first) reader_.refuse("first, last and step", line());
    return {first, last, step};
  }

  /// A label or the name of another set, in an instance: "wing-1.12", "wing-1.tip".
  AbaqusModel::Entry read_member(std::string_view word, Kind kind, AbaqusModel::ScopeId scope) {
    if (const std::size_t point = word.rfind('.'); point != std::string_view::npos) {
      if (const auto* instance = model_.find_instance(word.substr(0, point))) {
        scope = *instance;
        word.remove_prefix(point + 1);
      }
    }
    if (word.size() > 1 && word.front() == '"' && word.back() == '"') {
      word = word.substr(1, word.size() - 2);
    }
    const bool number = !word.empty() && word.find_first_not_of("0123456789") == std::string::npos;
    if (!number) return {kind, scope, false, {}, std::string(word), reader_.place()};
    const std::int64_t label = reader_.label(word);
    return {kind, scope, false, {label, label, 1}, {}, reader_.place()};
  }

  /// A composite has its materials in its data lines and is one of its own.
  void read_section(const DeckKeyword& keyword) {
    const std::string set = keyword.value("ELSET");
    if (set.empty()) return;
    std::string material = keyword.value("MATERIAL");
    if (material.empty()) {
      material = "section in line " + std::to_string(keyword.place.line) + " of file " +
                 std::to_string(keyword.place.file);
    }
    model_.add_section(scope_, set, material, keyword.place);
  }

  /// Without data lines it ends a local system.
  bool read_system(const DeckKeyword&) {
    in_local_system_ = false;
    while (true) {
      if (!reader_.next()) return false;
      if (reader_.at_keyword()) return true;
      in_local_system_ = true;
    }
  }

  // --- parts

  void enter_part(const DeckKeyword& keyword) {
    const std::string name = keyword.value("NAME");
    if (name.empty()) reader_.fail_at(keyword.place, "expected NAME=, the name of the part");
    if (!part_.empty()) reader_.fail_at(keyword.place, "expected *END PART before the next part");
    if (model_.find_part(name) != nullptr) {
      reader_.fail_at(keyword.place, "expected each part once, found \"" + name + "\" again");
    }
    part_ = name;
    scope_ = model_.add_scope(name);
  }

  /// An instance of a part without nodes has a mesh of its own.
  void enter_instance(const DeckKeyword& keyword) {
    const std::string name = keyword.value("NAME");
    const std::string part = keyword.value("PART");
    const auto* known = model_.find_part(part);
    if (!part.empty() && known == nullptr) {
      reader_.fail_at(keyword.place, "there is no part \"" + part + "\"");
    }
    scope_ = known != nullptr && model_.has_nodes(*known) ? *known : model_.add_scope(name);
    model_.add_instance(name, scope_);
  }

  void leave_part() {
    scope_ = 0;
    part_.clear();
    in_local_system_ = false;
  }

  DeckReader reader_;
  AbaqusModel model_;
  AbaqusModel::ScopeId scope_ = 0;
  std::string part_;  // that is being read
  bool in_local_system_ = false;
  std::vector<std::string_view> words_;
};

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
  DeckParser parser(file);
  parser.parse();
  parser.store(content);
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
