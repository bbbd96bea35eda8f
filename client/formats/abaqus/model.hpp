#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "content.hpp"
#include "deck_reader.hpp"
#include "elements.hpp"
#include "notes.hpp"

namespace meshsmooth::formats {

/// A side of an element: "S2", or the edge of a shell, "E2".
struct AbaqusSide {
  int number;
  bool edge_of_shell;
};

/// The nodes, elements, sets and sections of a deck while it is read. What one line says of others
/// is looked up when all are known, so their order does not matter.
class AbaqusModel {
 public:
  enum class Kind { nodes, elements };
  using ScopeId = std::size_t;  // a part, or 0: what stands in none

  AbaqusModel() : scopes_(1) {}

  // --- where labels and names count
  ScopeId add_scope(const std::string& name);
  [[nodiscard]] bool has_nodes(ScopeId scope) const { return !scopes_[scope].nodes.empty(); }
  [[nodiscard]] const ScopeId* find_part(const std::string& name) const;
  void add_instance(const std::string& name, ScopeId scope);
  [[nodiscard]] const ScopeId* find_instance(std::string_view name) const;

  // --- data lines
  /// A label that is taken is of the same node again.
  NodeId add_node(ScopeId scope, std::int64_t label, const std::string& set);
  [[nodiscard]] NodeId node_count() const { return static_cast<NodeId>(node_labels_.size()); }
  /// What `add_element` takes for a node of another scope than the element's.
  [[nodiscard]] std::optional<std::int64_t> find_corner(ScopeId scope, std::int64_t label) const;
  /// The cell type of held elements of this name.
  [[nodiscard]] int held_type(const std::string& name);
  /// Null, or where the element is that has the label already.
  [[nodiscard]] const DeckPlace* add_element(ScopeId scope, std::int64_t label,
                                             const AbaqusElement& type,
                                             const std::vector<std::int64_t>& nodes,
                                             const std::string& set, DeckPlace place);
  struct Range {
    std::int64_t first;
    std::int64_t last;
    std::int64_t step;
  };
  struct Entry {
    Kind kind;         // of what the range or name stands for
    ScopeId scope;     // where it counts
    bool generated;    // labels that do not exist are left out
    Range range;       // of labels, unless there is a name
    std::string name;  // of another set
    DeckPlace place;
  };
  void add_set(ScopeId scope, Kind kind, const std::string& name);
  void add_to_set(ScopeId scope, Kind kind, const std::string& name, Entry entry);
  /// The nodes or sets of nodes of an equation's terms, which have to match. Of sets it is one for
  /// each of their nodes, in their order.
  void add_equation(std::vector<Entry> terms) { equations_.push_back(std::move(terms)); }
  /// The sides of one number of an element or a set of elements, on a surface.
  void add_to_surface(ScopeId scope, const std::string& name, Entry elements, AbaqusSide side);
  void add_section(ScopeId scope, const std::string& element_set, const std::string& material,
                   DeckPlace place);

  /// Fills all but the text and the positions. As in CalculiX, labels in sets, nodes of held
  /// elements and sets of sections that are not there are left out, with a note. Throws
  /// FORMAT_ERROR where an element or set names something else that is not there.
  [[nodiscard]] std::shared_ptr<PlainDataset> store(const DeckReader& reader, FileContent& content,
                                                    Notes& notes);

 private:
  struct Set {
    std::string name;
    std::vector<std::int64_t> members;  // nodes or elements
    std::vector<Entry> entries;         // to be resolved
    bool resolving = false;
  };
  using Sets = std::map<std::string, Set>;  // by the name in capitals
  struct Surface {
    std::string name;
    std::vector<std::pair<Entry, AbaqusSide>> parts;  // elements, and which of their sides
  };
  struct Section {
    std::string element_set;
    std::int32_t material;
    DeckPlace place;
  };
  struct Scope {
    std::string name;
    std::unordered_map<std::int64_t, std::int64_t> nodes;     // by label
    std::unordered_map<std::int64_t, std::int64_t> elements;  // by label
    Sets node_sets;
    Sets element_sets;
    std::map<std::string, Surface> surfaces;  // by the name in capitals
    std::vector<Section> sections;
  };
  struct Element {
    ScopeId scope;
    std::int64_t label;
    AbaqusElement type;
    std::size_t first;  // of `corners_`
    DeckPlace place;
  };

  static constexpr std::int64_t kMissing = -1;  // a node of a held element that is not there

  Sets& sets(ScopeId scope, Kind kind);
  Set& set(ScopeId scope, Kind kind, const std::string& name);
  Set& resolved(const DeckReader& reader, ScopeId scope, Kind kind, const std::string& name,
                DeckPlace place, Notes& notes);
  void resolve(const DeckReader& reader, Kind kind, const Entry& entry,
               std::vector<std::int64_t>& members, Notes& notes);
  void add_labels(const DeckReader& reader, const Entry& entry, std::vector<std::int64_t>& members,
                  Notes& notes) const;
  void append_nodes_of(const std::vector<std::int64_t>& elements,
                       std::vector<std::int64_t>& nodes) const;
  [[nodiscard]] std::size_t end_of(std::size_t element) const;
  void resolve_corners(const DeckReader& reader, Notes& notes);
  void store_cells(FileContent& content, PlainDataset& dataset) const;
  void store_sets(const DeckReader& reader, const PlainDataset& dataset, FileContent& content,
                  Notes& notes);
  void append_side(std::size_t element, AbaqusSide side, NodeSet& set) const;
  void store_surfaces(const DeckReader& reader, FileContent& content, Notes& notes);
  void store_equations(const DeckReader& reader, FileContent& content, Notes& notes);
  void store_materials(const DeckReader& reader, PlainDataset& dataset, Notes& notes);
  [[nodiscard]] std::vector<std::string> names_of(ScopeId scope) const;

  std::vector<Scope> scopes_;
  std::map<std::string, ScopeId> parts_;      // by the name in capitals
  std::map<std::string, ScopeId> instances_;  // by the name in capitals
  std::vector<std::pair<std::string, ScopeId>> instance_names_;
  std::vector<std::int64_t> node_labels_;
  std::vector<Element> elements_;
  std::vector<std::int64_t> corners_;  // labels, or -1 - node; then nodes, or kMissing
  std::vector<std::string> held_types_;
  std::vector<std::vector<Entry>> equations_;
  std::map<std::string, std::int32_t> materials_;
  int nested_ = 0;  // sets that are being resolved
};

}  // namespace meshsmooth::formats
