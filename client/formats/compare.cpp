#include "compare.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "cells.hpp"
#include "content.hpp"
#include "temporary_folder.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using Differences = std::vector<std::string>;

std::string both(std::size_t a, std::size_t b) {
  return std::to_string(a) + " and " + std::to_string(b);
}

void compare_meshes(const MeshFile& a, const MeshFile& b, Differences& differences) {
  if (a.mesh.node_count() != b.mesh.node_count()) {
    differences.push_back("nodes: " + both(a.mesh.node_count(), b.mesh.node_count()));
  }
  if (a.mesh.element_count() != b.mesh.element_count()) {
    differences.push_back("elements: " + both(a.mesh.element_count(), b.mesh.element_count()));
    return;
  }
  std::int64_t element = 0;
  const auto element_differs = [&](const std::string& what) {
    differences.push_back("elements: " + std::to_string(a.file_element_id(element)) + what);
  };
  for (std::size_t n = 0; n < std::min(a.mesh.blocks.size(), b.mesh.blocks.size()); ++n) {
    const ElementBlock& own = a.mesh.blocks[n];
    const ElementBlock& other = b.mesh.blocks[n];
    const std::string name(element_name(own.type));
    if (own.type != other.type) {
      element_differs(" is a " + name + " and a " + std::string(element_name(other.type)));
      return;
    }
    const auto [at, there] = std::ranges::mismatch(own.nodes, other.nodes);
    element += (at - own.nodes.begin()) / static_cast<std::ptrdiff_t>(element_width(own.type));
    if (at != own.nodes.end() && there != other.nodes.end()) {
      element_differs(" (" + name + ") has other nodes");
      return;
    }
    if (own.nodes.size() != other.nodes.size()) {
      differences.push_back("elements: other numbers of " + name + " elements");
      return;
    }
  }
}

/// The text outside the coordinates, piece by piece; that of several files as if it were one.
class Pieces {
 public:
  explicit Pieces(const FileContent& content) {
    if (content.segments.empty()) add(content.text, content.fields);
    for (const TextSegment& segment : content.segments) {
      if (!segment.directive) add(segment.text, segment.fields);
    }
    std::ranges::sort(fields_, {}, &CoordinateFields::Field::begin);
  }
  [[nodiscard]] std::size_t count() const { return fields_.size() + 1; }
  [[nodiscard]] std::size_t begin(std::size_t piece) const {
    return piece == 0 ? 0 : fields_[piece - 1].begin + fields_[piece - 1].length;
  }
  [[nodiscard]] std::string_view operator[](std::size_t piece) const {
    const std::size_t end = piece < fields_.size() ? fields_[piece].begin : text_.size();
    return std::string_view(text_).substr(begin(piece), end - begin(piece));
  }
  [[nodiscard]] std::string place(std::size_t offset) const {
    const auto lines = std::ranges::count(std::string_view(text_).substr(0, offset), '\n');
    return "line " + std::to_string(lines + 1) + ", byte " + std::to_string(offset);
  }

 private:
  void add(std::string_view text, const CoordinateFields& fields) {
    if (!text_.empty() && !text_.ends_with('\n')) text_ += '\n';
    for (const auto& node : fields.fields) {
      for (CoordinateFields::Field field : node) {
        field.begin += text_.size();
        fields_.push_back(field);
      }
    }
    text_ += text;
  }

  std::string text_;
  std::vector<CoordinateFields::Field> fields_;
};

void compare_texts(const FileContent& a, const FileContent& b, Differences& differences) {
  const Pieces own(a), other(b);
  for (std::size_t piece = 0; piece < std::min(own.count(), other.count()); ++piece) {
    if (own[piece] == other[piece]) continue;
    const auto same = std::ranges::mismatch(own[piece], other[piece]).in1 - own[piece].begin();
    differences.push_back("text: from " +
                          own.place(own.begin(piece) + static_cast<std::size_t>(same)));
    return;
  }
  if (own.count() != other.count()) {
    differences.push_back("text: " + both(own.count() / 3, other.count() / 3) + " nodes in it");
  }
  if (a.companion_text != b.companion_text) differences.emplace_back("text: of the .ele file");
}

void compare_cells(const Dataset& a, const Dataset& b, Differences& differences) {
  if (a.cell_count() != b.cell_count()) {
    differences.push_back("cells: " + both(static_cast<std::size_t>(a.cell_count()),
                                           static_cast<std::size_t>(b.cell_count())));
    return;
  }
  Cell own, other;
  for (std::int64_t id = 0; id < a.cell_count(); ++id) {
    a.get_cell(id, own);
    b.get_cell(id, other);
    if (own.type == other.type && own.nodes == other.nodes) continue;
    differences.push_back("cells: number " + std::to_string(id) +
                          (own.type == other.type ? " has other nodes" : " has another type"));
    return;
  }
}

void compare_arrays(const Dataset& a, const Dataset& b, Differences& differences) {
  std::map<std::string, StoredArray> others;
  for (StoredArray& array : b.stored_arrays()) others.emplace(array.name, std::move(array));
  for (const StoredArray& own : a.stored_arrays()) {
    const auto found = others.extract(own.name);
    if (found.empty()) {
      differences.push_back(own.name + ": only in the first file");
    } else if (found.mapped().type != own.type) {
      differences.push_back(own.name + ": " + own.type + " and " + found.mapped().type);
    } else if (found.mapped().bytes != own.bytes) {
      differences.push_back(own.name + ": other values");
    }
  }
  for (const auto& [name, array] : others)
    differences.push_back(name + ": only in the second file");
}

/// Names what two lists of named things do not have in common.
template <class Things, class IsSame>
void compare_named(const std::string& kind, const Things& a, const Things& b, const IsSame& is_same,
                   Differences& differences) {
  for (std::size_t n = 0; n < std::max(a.size(), b.size()); ++n) {
    if (n < a.size() && n < b.size() && a[n].name == b[n].name && is_same(a[n], b[n])) continue;
    differences.push_back(kind + ": " + (n < a.size() ? a[n].name : b[n].name));
    return;
  }
}

void compare_contents(const FileContent& a, const FileContent& b, Differences& differences) {
  compare_cells(*a.dataset, *b.dataset, differences);
  compare_arrays(*a.dataset, *b.dataset, differences);
  if (a.node_ids != b.node_ids) differences.emplace_back("node ids");
  if (a.cell_ids != b.cell_ids) differences.emplace_back("element ids");
  compare_named(
      "group", a.groups, b.groups,
      [](const CellGroup& x, const CellGroup& y) {
        return x.dimension == y.dimension && std::string_view(x.array) == y.array &&
               x.values == y.values;
      },
      differences);
  if (a.group_sets != b.group_sets) differences.emplace_back("elements of groups");
  compare_named(
      "node set", a.node_sets, b.node_sets,
      [](const NodeSet& x, const NodeSet& y) { return x.nodes == y.nodes; }, differences);
}

bool has_text(const FileContent& content) {
  return !content.text.empty() || !content.segments.empty();
}

/// Whether the bytes are compared by writing: HDF5, netCDF, ADF, and files of which it is not known
/// where each coordinate stands (VTK's, STL).
bool is_container(const FileContent& content) {
  const bool has_fields = !content.fields.fields.empty() || !content.segments.empty();
  return !content.arrays.empty() || (!content.text.empty() && !has_fields);
}

/// Whether the first file with the coordinates of the second is the second, byte for byte.
bool becomes(const MeshFile& a, const MeshFile& b) {
  const FileContent& other = *b.content();
  if (a.mesh.positions.index() != b.mesh.positions.index()) return false;
  const TemporaryFolder folder;
  const std::string stem = other.companion.empty() ? "made" : other.companion.stem().string();
  const std::filesystem::path made = folder.path() / (stem + other.extension);
  MeshFile changed = a;
  changed.mesh.positions = b.mesh.positions;
  write_mesh_file(made, changed);
  if (read_bytes(made) != other.text) return false;
  return other.companion.empty() ||
         read_bytes(folder.path() / other.companion.filename()) == other.companion_text;
}

}  // namespace

std::string_view compared_by_name(ComparedBy compared_by) {
  constexpr std::array<std::string_view, 3> kNames = {"bytes", "arrays", "meshes"};
  return kNames[static_cast<std::size_t>(compared_by)];
}

FileDifference compare_files(const MeshFile& a, const MeshFile& b) {
  FileDifference result;
  compare_meshes(a, b, result.differences);
  result.same_topology = result.differences.empty();
  const FileContent* const own = a.content().get();
  const FileContent* const other = b.content().get();
  if (own == nullptr || other == nullptr || own->extension != other->extension) return result;
  if (is_container(*own) || is_container(*other)) {
    if (!result.same_topology) return result;
    const bool same = becomes(a, b);
    result.compared_by = same ? ComparedBy::bytes : ComparedBy::arrays;
    if (!same) compare_contents(*own, *other, result.differences);
    return result;
  }
  const bool texts = has_text(*own) && has_text(*other);
  const bool all_texts = texts && own->extension != ".foam";  // which has more files
  result.compared_by = all_texts ? ComparedBy::bytes : ComparedBy::arrays;
  if (texts) compare_texts(*own, *other, result.differences);
  if (!all_texts) compare_contents(*own, *other, result.differences);
  return result;
}

}  // namespace meshsmooth::formats
