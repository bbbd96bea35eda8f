#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "content.hpp"
#include "nastran/cards.hpp"
#include "nastran/coordinate_systems.hpp"
#include "nastran/element_cards.hpp"
#include "nastran/ids.hpp"
#include "nastran/names.hpp"

namespace meshsmooth::formats {

/// The grid points, coordinate systems and elements of a deck while it is read. What a card says of
/// others is looked up when all are known, so their order does not matter.
class NastranModel {
 public:
  explicit NastranModel(NastranLines& lines) : lines_(lines), scopes_(1) {}

  /// A superelement or auxiliary model: its ids count there alone. 0: the main model.
  void enter_scope(const std::string& name);

  void add_grid(NastranCard& card);
  void add_grid_defaults(const NastranCard& card);  // GRDSET
  /// False: the card is none of a coordinate system.
  bool add_system(const NastranCard& card);
  void add_element(NastranCard& card, const NastranElement& type);
  /// An element that nobody here knows, if it turns out to connect grid points.
  void add_unknown(const NastranCard& card);
  void add_material(std::int64_t property, std::int64_t material);

  /// All but the text. Throws FORMAT_ERROR where something is named that is not in the deck.
  void store(const NastranNames& names, FileContent& content);
  /// By GRID card, the node; empty: all are nodes of their own.
  [[nodiscard]] const std::vector<NodeId>& node_of_grid() const { return node_of_grid_; }
  /// Those that define coordinate systems.
  [[nodiscard]] std::vector<NodeId> system_nodes() const;

 private:
  struct Place {
    std::uint32_t file;
    std::uint32_t line;
  };
  struct Scope {
    std::string name;
    std::vector<std::int64_t> ids;  // of its grids
    std::vector<NodeId> grids;      // of the same
    IdIndex index;                  // into them
    std::int64_t default_system = 0;
    std::map<std::int64_t, std::size_t> systems;  // by id
  };
  struct Grid {
    std::int64_t id;
    std::int64_t system;  // kBlank: by default
    Place place;
    std::uint32_t scope;
  };
  struct Element {
    const NastranElement* type;
    std::int64_t id;
    std::int64_t property;
    std::int64_t material;  // 0: that of the property
    std::size_t first;      // of `corners_`
    Place place;
    std::uint32_t scope;
  };
  static constexpr std::int64_t kBlank = -1;

  [[nodiscard]] std::int64_t id_of(const NastranCard& card, std::size_t field,
                                   const char* what) const;
  [[nodiscard]] std::int64_t id_or(const NastranCard& card, std::size_t field,
                                   std::int64_t otherwise) const;
  double real_of(const NastranCard& card, std::size_t field) const;
  void define(const NastranCard& card, const CoordinateSystems::Definition& definition);
  void check_fields(const NastranCard& card) const;
  void add_corners(const NastranCard& card, const NastranElement& type);
  void add_points(const NastranCard& card, const NastranElement& type);
  void add_weighted_points(const NastranCard& card);

  [[noreturn]] void fail_at(const Place& place, const std::string& what) const;
  [[nodiscard]] std::optional<NodeId> find_node(const Scope& scope, std::int64_t id) const;
  void number_grids();
  void link_systems();
  [[nodiscard]] std::vector<Vec3d> make_positions();
  [[nodiscard]] std::size_t end_of(std::size_t element) const;
  void store_cells(FileContent& content, PlainDataset& dataset);
  void add_mesh_cell(const Element& element, PlainDataset& dataset);
  void add_other_cell(const Element& element, std::size_t end, PlainDataset& dataset);
  void find_repeated_elements();
  void store_columns(FileContent& content, PlainDataset& dataset) const;
  void store_groups(const NastranNames& names, FileContent& content,
                    const PlainDataset& dataset) const;
  void store_sets(const NastranNames& names, FileContent& content) const;

  NastranLines& lines_;
  std::vector<Scope> scopes_;
  std::size_t scope_ = 0;
  std::vector<Grid> grids_;
  std::vector<Vec3d> local_;  // by grid
  CoordinateSystems systems_;
  std::vector<Place> system_places_;
  std::deque<std::string> unknown_names_;  // whose views must stay
  std::deque<NastranElement> unknown_types_;
  std::vector<Element> elements_;
  // Ids, 0: left out; below 0: the first of a range, whose last follows.
  std::vector<std::int64_t> corners_;
  std::map<std::int64_t, std::int64_t> materials_;  // by property
  std::vector<NodeId> node_of_grid_;
  std::set<std::size_t> repeated_;  // elements that are there already
  std::vector<std::int64_t> node_ids_;
  std::vector<std::size_t> cell_elements_;  // by cell
  std::vector<std::int64_t> nodes_;         // of the cell that is being made
};

}  // namespace meshsmooth::formats
