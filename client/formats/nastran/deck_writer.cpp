#include "nastran/deck_writer.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "cells.hpp"
#include "content.hpp"
#include "nastran/numbers.hpp"
#include "node_orders.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

constexpr std::int64_t kLargestId = 99'999'999;

struct CellCard {
  int vtk_type;
  std::string_view name;
};

constexpr auto kCards = std::to_array<CellCard>({
    {kVertexCell, "CONM2"},
    {kLineCell, "CROD"},
    {kEdge3Cell, "CBEAM3"},
    {kTriangleCell, "CTRIA3"},
    {kQuadCell, "CQUAD4"},
    {kTetrahedronCell, "CTETRA"},
    {kPyramidCell, "CPYRAM"},
    {kWedgeCell, "CPENTA"},
    {kHexahedronCell, "CHEXA"},
    {kTriangle6Cell, "CTRIA6"},
    {kQuad8Cell, "CQUAD8"},
    {kQuad9Cell, "CQUAD"},
    {kTetrahedron10Cell, "CTETRA"},
    {kPyramid13Cell, "CPYRAM"},
    {kWedge15Cell, "CPENTA"},
    {kHexahedron20Cell, "CHEXA"},
});

std::string in_field(std::string_view word) {
  constexpr std::size_t kColumns = 8;
  return std::string(word) + std::string(kColumns - std::min(word.size(), kColumns), ' ');
}

/// The column's values where they are ids of their own, else 1, 2 …
std::vector<std::int64_t> make_ids(const std::optional<Column>& column, std::int64_t count) {
  std::vector<std::int64_t> ids(static_cast<std::size_t>(count));
  for (std::size_t place = 0; place < ids.size(); ++place) {
    ids[place] = static_cast<std::int64_t>(place) + 1;
  }
  if (!column) return ids;
  std::vector<std::int64_t> own;
  for (const double value : column->values) {
    if (!(value >= 1 && value <= static_cast<double>(kLargestId))) return ids;
    own.push_back(static_cast<std::int64_t>(value));
  }
  std::vector<std::int64_t> sorted = own;
  std::ranges::sort(sorted);
  return std::ranges::adjacent_find(sorted) == sorted.end() ? own : ids;
}

/// A card in small fields, with unmarked continuations.
void append_card(std::string& text, std::string_view name, std::span<const std::int64_t> fields) {
  constexpr std::size_t kPerLine = 8;
  text += in_field(name);
  for (std::size_t field = 0; field < fields.size(); ++field) {
    if (field > 0 && field % kPerLine == 0) text.append("\n").append(in_field("+"));
    text += in_field(fields[field] == 0 ? "" : std::to_string(fields[field]));
  }
  text.erase(text.find_last_not_of(' ') + 1);
  text += '\n';
}

class DeckText {
 public:
  DeckText(const std::filesystem::path& file_name, const MeshFile& file)
      : file_name_(file_name),
        file_(file),
        dataset_(dataset_of(file)),
        node_ids_(make_ids(dataset_->node_column(kNodeIdArray), dataset_->node_count())) {}

  std::string make() {
    append_names();
    text_ += "BEGIN BULK\n";
    append_nodes();
    append_cells();
    return std::move(text_) + "ENDDATA\n";
  }

 private:
  static constexpr std::array<const char*, 3> kArrays = {kPhysicalArray, kEntityArray,
                                                         kReferenceArray};

  /// Those of groups that are told by the array that gives the properties.
  void append_names() {
    for (const char* array : kArrays) {
      if (!properties_) properties_ = dataset_->cell_column(array);
    }
    if (!properties_ || !file_.content()) return;
    for (const CellGroup& group : file_.content()->groups) {
      const std::string number = std::to_string(group.values.front());
      if (group.array != properties_->name || group.values.size() != 1 || group.name == number) {
        continue;
      }
      std::string name = group.name;
      std::ranges::replace_if(
          name, [](char c) { return c == ';' || c == '\n' || c == '\r'; }, ' ');
      text_ += "$ANSA_NAME_COMMENT;" + number + (group.dimension == 3 ? ";PSOLID;" : ";PSHELL;") +
               name + ";\n";
    }
  }

  void append_nodes() {
    const auto append = [&](const auto& positions) {
      for (std::size_t node = 0; node < positions.size(); ++node) {
        const auto place = vec3_cast<double>(positions[node]);
        text_ += "GRID*   ";
        append_wide(std::to_string(node_ids_[node]));
        append_wide({});
        append_wide(format_nastran_real(place.x, 16));
        append_wide(format_nastran_real(place.y, 16));
        text_ += "\n*       " + format_nastran_real(place.z, 16) + '\n';
      }
    };
    std::visit(append, file_.mesh.positions);
  }

  void append_wide(std::string_view word) {
    text_.append(word).append(16 - std::min<std::size_t>(word.size(), 16), ' ');
  }

  /// Polylines and points of one cell become several, so all are numbered anew where there are any.
  void append_cells() {
    ids_ = make_ids(dataset_->cell_column(kElementIdArray), dataset_->cell_count());
    next_id_ = ids_.empty() ? 1 : *std::ranges::max_element(ids_) + 1;
    Cell cell;
    for (std::int64_t id = 0; id < dataset_->cell_count(); ++id) {
      dataset_->get_cell(id, cell);
      const auto place = static_cast<std::size_t>(id);
      const std::int64_t property =
          properties_ ? static_cast<std::int64_t>(properties_->values[place]) : 0;
      const bool points = cell.type == kPolyVertexCell;
      if (points || cell.type == kPolyLineCell) {
        const std::size_t width = points ? 1 : 2;
        for (std::size_t first = 0; first + width <= cell.nodes.size(); ++first) {
          append_cell(points ? kVertexCell : kLineCell, first == 0 ? ids_[place] : next_id_++,
                      property, std::span(cell.nodes).subspan(first, width));
        }
        continue;
      }
      append_cell(cell.type, ids_[place], property, cell.nodes);
    }
  }

  void append_cell(int type, std::int64_t id, std::int64_t property,
                   std::span<const std::int64_t> nodes) {
    const CellKind* const kind = find_vtk_cell(type, nodes.size());
    const auto* const card = kind == nullptr
                                 ? kCards.end()
                                 : std::ranges::find(kCards, kind->vtk_type, &CellCard::vtk_type);
    if (card == kCards.end()) {
      fail("ELEMENT_NOT_SUPPORTED", file_name_,
           "Nastran files cannot carry a " +
               (kind == nullptr ? dataset_->cell_name(type) : std::string(kind->name)));
    }
    const bool point = kind->vtk_type == kVertexCell;
    std::vector<std::int64_t> fields(nodes.size() + 2, 0);
    fields[0] = id;
    if (!point) fields[1] = property > 0 && property <= kLargestId ? property : 1;
    const auto places = places_in(NodeOrder::exodus, *kind);
    for (std::size_t node = 0; node < nodes.size(); ++node) {
      const std::size_t field = point ? 1 : 2 + static_cast<std::size_t>(places[node]);
      fields[field] = node_ids_.at(static_cast<std::size_t>(nodes[node]));
    }
    append_card(text_, card->name, fields);
    if (point) text_.insert(text_.size() - 1, std::string(16 - last_width(), ' ') + "0.");
  }

  /// Of the columns that the last field of the last line takes.
  [[nodiscard]] std::size_t last_width() const {
    const std::size_t begin = text_.rfind('\n', text_.size() - 2) + 1;
    return (text_.size() - 1 - begin) - 16;
  }

  const std::filesystem::path& file_name_;
  const MeshFile& file_;
  std::shared_ptr<const Dataset> dataset_;
  std::vector<std::int64_t> node_ids_;
  std::vector<std::int64_t> ids_;
  std::int64_t next_id_ = 1;
  std::optional<Column> properties_;
  std::string text_;
};

}  // namespace

std::string make_nastran(const std::filesystem::path& path, const MeshFile& file) {
  return DeckText(path, file).make();
}

}  // namespace meshsmooth::formats
