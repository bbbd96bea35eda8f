#include "element_reader.hpp"

#include <algorithm>
#include <charconv>

namespace meshsmooth::formats {
namespace {

bool is_held(const AbaqusElement& type) { return type.vtk_type >= kFirstOwnCellType; }

bool is_line(const AbaqusElement& type) {
  return type.vtk_type == kLineCell || type.vtk_type == kEdge3Cell;
}

}  // namespace

bool ElementReader::read(const DeckKeyword& keyword, AbaqusModel::ScopeId scope) {
  Block block{in_capitals(keyword.value("TYPE")), {}, keyword.value("ELSET"), scope};
  if (block.type_name.empty()) {
    reader_.fail_at(keyword.place, "expected TYPE=, the type of the elements");
  }
  block.type = find_abaqus_element(block.type_name);
  if (is_held(block.type)) {
    const auto own = user_types_.find(block.type_name);
    if (own != user_types_.end()) block.type.node_count = own->second;
    block.type.vtk_type = model_.held_type(block.type_name);
  }
  if (!block.set.empty()) model_.add_set(scope, AbaqusModel::Kind::elements, block.set);
  const bool by_rows = is_held(block.type) && block.type.node_count == 0;
  return by_rows ? read_rows(block) : read_counted(block);
}

void ElementReader::define(const DeckKeyword& keyword) {
  const std::string type = in_capitals(keyword.value("TYPE"));
  const std::string digits = keyword.value("NODES");
  int count = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), count);
  if (type.empty() || error != std::errc() || end != digits.data() + digits.size() || count < 1) {
    reader_.fail_at(keyword.place, "expected TYPE= and NODES=, the number of nodes of the type");
  }
  for (const std::size_t met : met_[type]) {
    if (met == static_cast<std::size_t>(count)) continue;
    reader_.fail_at(keyword.place, "an element of the type " + type + " before this line has " +
                                       std::to_string(met) + " nodes, not " +
                                       std::to_string(count) + "; define the type before them");
  }
  user_types_[type] = count;
}

void ElementReader::add(const Block& block, std::int64_t label,
                        const std::vector<std::int64_t>& nodes, DeckPlace place) {
  const DeckPlace* const first =
      model_.add_element(block.scope, label, block.type, nodes, block.set, place);
  if (first == nullptr) return;
  reader_.fail_at(place, "expected each element once, found " + std::to_string(label) +
                             " again, which is in " + reader_.describe(*first));
}

// --- elements of a known number of nodes ----------------------------------------

bool ElementReader::read_counted(const Block& block) {
  std::vector<std::int64_t> nodes;
  while (true) {
    if (!reader_.next()) return false;
    if (reader_.at_keyword()) return true;
    const DeckPlace place = reader_.place();
    split_data(reader_.line(), words_);
    const std::int64_t label = reader_.label(words_.front());
    read_corners(label, block, nodes);
    add(block, label, nodes, place);
  }
}

/// The rest of an element whose first line is in `words_`. As CalculiX has it, the element goes on
/// in the next line where nodes are missing, and numbers after the last one count for nothing.
void ElementReader::read_corners(std::int64_t label, const Block& block,
                                 std::vector<std::int64_t>& nodes) {
  nodes.clear();
  const auto count = static_cast<std::size_t>(block.type.node_count);
  const bool may_be_none = count == 0 || is_held(block.type);  // the ground, an end of a network
  std::size_t word = 1;
  std::size_t found = 0;
  while (count == 0 || found < count) {
    for (; word < words_.size() && (count == 0 || found < count); ++word, ++found) {
      const std::int64_t corner = read_corner(words_[word], may_be_none);
      if (corner != 0) nodes.push_back(corner);
    }
    if (count == 0 || found == count) break;
    const std::string so_far = "element " + std::to_string(label) + " has " +
                               std::to_string(found) + " of its " + std::to_string(count) +
                               " nodes";
    const DeckPlace place = reader_.place();
    if (!reader_.next()) reader_.fail_at(place, "the deck ends where " + so_far, "FILE_TRUNCATED");
    if (reader_.at_keyword()) reader_.fail_at(place, so_far);
    split_data(reader_.line(), words_);
    word = 0;
  }
  if (nodes.empty()) reader_.refuse("the nodes of an element", reader_.line());
  if (word < words_.size() && !is_line(block.type)) {
    notes_.add("more numbers", [&] {
      return reader_.describe(reader_.place()) + ": what follows the " + std::to_string(count) +
             " nodes of element " + std::to_string(label) + " is ignored, as CalculiX does";
    });
  }
}

/// A label, or a node of an instance: "wing-1.12".
std::int64_t ElementReader::read_corner(std::string_view word, bool may_be_none) const {
  const std::string_view number = trimmed(word);
  if (may_be_none && (number.empty() || number == "0")) return 0;
  const std::size_t point = number.rfind('.');
  if (point == std::string_view::npos) return reader_.label(number);
  const auto* instance = model_.find_instance(number.substr(0, point));
  if (instance == nullptr) return reader_.label(number);
  const auto corner = model_.find_corner(*instance, reader_.label(number.substr(point + 1)));
  if (!corner) reader_.refuse("a node of the instance", number);
  return *corner;
}

// --- elements that end where their lines do ------------------------------------

bool ElementReader::read_rows(const Block& block) {
  std::vector<Row> rows;
  bool more = true;
  while ((more = reader_.next()) && !reader_.at_keyword()) {
    Row row{reader_.place(), {}, trimmed(reader_.line()).ends_with(',')};
    split_data(reader_.line(), words_);
    const bool begins = rows.empty() || !rows.back().continued;
    for (const std::string_view word : words_) {
      const bool is_label = begins && row.numbers.empty();
      row.numbers.push_back(is_label ? reader_.label(word) : read_corner(word, true));
    }
    rows.push_back(std::move(row));
  }
  join_rows(block, rows);
  return more;
}

/// A comma at the end of a line continues the element, unless every line has one and as many
/// numbers: then a program wrote it that ends every line so.
void ElementReader::join_rows(const Block& block, const std::vector<Row>& rows) {
  const bool all = rows.size() > 1 && std::ranges::all_of(rows, &Row::continued);
  const bool alike = std::ranges::all_of(
      rows, [&](const Row& row) { return row.numbers.size() == rows.front().numbers.size(); });
  if (all && !alike) {
    reader_.fail_at(rows.back().place,
                    "every line of the elements of the type " + block.type_name +
                        " ends with a comma, so that nothing tells where one ends; remove it "
                        "after the last node of each");
  }
  std::vector<std::int64_t> nodes;
  for (std::size_t row = 0; row < rows.size();) {
    const Row& first = rows[row];
    std::vector<std::int64_t> numbers;
    do {
      numbers.insert(numbers.end(), rows[row].numbers.begin(), rows[row].numbers.end());
    } while (rows[row++].continued && !all && row < rows.size());
    const std::int64_t label = numbers.front();
    if (label < 1) reader_.fail_at(first.place, "expected the number of an element above 0");
    nodes.clear();
    std::copy_if(numbers.begin() + 1, numbers.end(), std::back_inserter(nodes),
                 [](std::int64_t node) { return node != 0; });
    if (nodes.empty()) {
      reader_.fail_at(first.place, "expected the nodes of element " + std::to_string(label));
    }
    met_[block.type_name].insert(numbers.size() - 1);
    add(block, label, nodes, first.place);
  }
}

}  // namespace meshsmooth::formats
