#include "deck_parser.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "deck_reader.hpp"
#include "element_reader.hpp"
#include "foreign_input.hpp"
#include "model.hpp"
#include "set_reader.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// Keywords by which Abaqus makes nodes or elements that are in no line of the deck.
constexpr auto kGenerators =
    std::to_array<std::string_view>({"NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY",
                                     "SYMMETRICMODELGENERATION", "SUBSTRUCTURE"});

/// Leaves the last definition of each node in the segments: it counts, in Abaqus and in CalculiX.
void drop_earlier_definitions(std::vector<TextSegment>& segments, std::size_t node_count) {
  std::vector<std::uint8_t> defined(node_count, 0);
  for (auto segment = segments.rbegin(); segment != segments.rend(); ++segment) {
    CoordinateFields kept;
    kept.style = segment->fields.style;
    std::vector<NodeId> nodes;
    for (std::size_t place = segment->nodes.size(); place-- > 0;) {
      const NodeId node = segment->nodes[place];
      if (std::exchange(defined[static_cast<std::size_t>(node)], 1) != 0) continue;
      nodes.push_back(node);
      kept.node_ids.push_back(segment->fields.node_ids[place]);
      kept.fields.push_back(segment->fields.fields[place]);
      kept.positions.push_back(segment->fields.positions[place]);
    }
    std::ranges::reverse(nodes);
    std::ranges::reverse(kept.node_ids);
    std::ranges::reverse(kept.fields);
    std::ranges::reverse(kept.positions);
    segment->fields = std::move(kept);
    segment->nodes = std::move(nodes);
  }
}

/// Reads the keywords that tell of the mesh, into the model.
class DeckParser {
 public:
  explicit DeckParser(const path& file)
      : reader_(file), elements_(reader_, model_, notes_), sets_(reader_, model_) {}

  void parse() {
    bool more = reader_.next();
    if (more && !reader_.at_keyword()) note_first_line();
    while (more) {
      if (!reader_.at_keyword()) {
        more = reader_.next();
        continue;
      }
      more = read_keyword(reader_.keyword());
    }
    if (!part_.empty()) reader_.truncated("without *END PART");
    if (model_.node_count() == 0) fail_foreign();
  }

  void store(FileContent& content) {
    const auto dataset = model_.store(reader_, content, notes_);
    reader_.store(content);
    const auto node_count = static_cast<std::size_t>(model_.node_count());
    if (redefined_) drop_earlier_definitions(content.segments, node_count);
    std::vector<Vec3d> positions(node_count);
    for (const TextSegment& segment : content.segments) {
      for (std::size_t place = 0; place < segment.nodes.size(); ++place) {
        positions[static_cast<std::size_t>(segment.nodes[place])] = segment.fields.positions[place];
      }
    }
    dataset->set_positions(std::move(positions));
    content.dataset = dataset;
    content.notes = notes_.texts();
  }

 private:
  using Kind = AbaqusModel::Kind;

  [[nodiscard]] std::string_view line() const { return reader_.line(); }

  /// CalculiX reads over all lines before the first keyword.
  void note_first_line() {
    fail_foreign();
    if (!has_deck_keyword(reader_.text())) {
      reader_.refuse("a keyword of Abaqus or CalculiX, which starts with *", line());
    }
    notes_.add("no keyword", [&] {
      return reader_.describe(reader_.place()) +
             ": what stands before the first keyword is ignored";
    });
  }
  void fail_foreign() const {
    const auto name = name_foreign_input(reader_.text());
    if (!name) return;
    reader_.fail_at({0, 0}, "this is " + *name + ", not a deck of Abaqus or CalculiX");
  }

  /// Moves past it and the data lines that it needs; false at the end of the deck.
  bool read_keyword(const DeckKeyword& keyword) {
    const std::string& name = keyword.name;
    if (name == "NODE" || name == "ELEMENT") {
      reader_.read_input_of(keyword);
      return name == "NODE" ? read_nodes(keyword) : elements_.read(keyword, scope_);
    }
    if (name == "NSET" || name == "ELSET") {
      return sets_.read_set(keyword, name == "NSET" ? Kind::nodes : Kind::elements, scope_);
    }
    if (name == "EQUATION") {
      reader_.read_input_of(keyword);
      return sets_.read_equations(scope_);
    }
    if (name == "SURFACE") return sets_.read_surface(keyword, scope_);
    if (name == "SYSTEM") return read_system(keyword);
    if (name == "USERELEMENT") elements_.define(keyword);
    if (name.ends_with("SECTION")) read_section(keyword);
    if (name == "KEYWORD") fail_foreign();
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

  // --- nodes

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
      const NodeId next = model_.node_count();
      const NodeId node = model_.add_node(scope_, label, set);
      if (node != next) {
        redefined_ = true;
        notes_.add("node again", [&] {
          return reader_.describe(reader_.place()) + ": node " + std::to_string(label) +
                 " is defined again; its last definition counts";
        });
      }
      reader_.add_node(node, label, coordinates);
    }
  }

  // --- sections

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
  Notes notes_;
  ElementReader elements_;
  SetReader sets_;
  AbaqusModel::ScopeId scope_ = 0;
  std::string part_;  // that is being read
  bool in_local_system_ = false;
  bool redefined_ = false;  // some nodes are
  std::vector<std::string_view> words_;
};

}  // namespace

void read_deck(const path& file, FileContent& content) {
  DeckParser parser(file);
  parser.parse();
  parser.store(content);
}

}  // namespace meshsmooth::formats
