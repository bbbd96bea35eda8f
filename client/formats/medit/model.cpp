#include "medit/model.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <span>

#include "cell_sides.hpp"
#include "cells.hpp"
#include "node_orders.hpp"
#include "text.hpp"

namespace meshsmooth::formats::medit {
namespace {

using std::filesystem::path;
using Places = std::array<std::size_t, kMaxCellNodes>;  // by node in VTK's order

/// Gmsh's, which is the usual one; those on edges and faces in VTK's order where these are not in
/// the middle of their corners.
Places usual_places(const CellKind& kind) {
  Places places{};
  const auto order =
      is_second_order(kind) && kind.vtk_type != kWedge18Cell && kind.vtk_type != kHexahedron27Cell
          ? NodeOrder::vtk
          : NodeOrder::gmsh;
  std::size_t node = 0;
  for (const std::int8_t place : places_in(order, kind)) {
    places[node++] = static_cast<std::size_t>(place);
  }
  return places;
}

/// The format does not fix the order of nodes after the corners, and programs differ. So it is that
/// in which they are closest to the middles of their corners in the first elements.
Places find_places(const CellKind& kind, std::span<const std::int64_t> nodes,
                   const std::vector<Vec3d>& positions) {
  constexpr std::size_t kSample = 1000;  // elements
  constexpr double kClearly = 0.25;      // of the squared distances in the usual order
  const Places usual = usual_places(kind);
  if (!kind.element || !is_second_order(*kind.element)) return usual;
  const auto width = static_cast<std::size_t>(kind.node_count);
  const std::size_t corners = element_width(linear_type(*kind.element));
  std::array<std::array<double, kMaxCellNodes>, kMaxCellNodes> distances{};
  const std::size_t end = std::min(nodes.size(), kSample * width);
  for (std::size_t first = 0; first < end; first += width) {
    const auto at = [&](std::size_t place) {
      return positions[static_cast<std::size_t>(nodes[first + place])];
    };
    std::size_t node = corners;
    for (const MidNode& mid : mid_nodes(*kind.element)) {
      Vec3d sum{0, 0, 0};
      for (std::size_t n = 0; n < static_cast<std::size_t>(mid.corner_count); ++n) {
        sum += at(usual[static_cast<std::size_t>(mid.corners[n])]);
      }
      const Vec3d middle = (1.0 / mid.corner_count) * sum;
      for (std::size_t place = corners; place < width; ++place) {
        const Vec3d off = at(place) - middle;
        distances[node][place] += dot(off, off);
      }
      ++node;
    }
  }
  Places places = usual;
  std::array<bool, kMaxCellNodes> taken{};
  double before = 0;
  double after = 0;
  for (std::size_t node = corners; node < width; ++node) {
    std::size_t best = usual[node];
    for (std::size_t place = corners; place < width; ++place) {
      if (distances[node][place] < distances[node][best]) best = place;
    }
    if (std::exchange(taken[best], true)) return usual;  // one place is the best for two
    places[node] = best;
    before += distances[node][usual[node]];
    after += distances[node][best];
  }
  return after < kClearly * before ? places : usual;
}

/// Checks the numbers and counts them from 0.
void resolve_vertices(const path& file, Section& section, std::size_t vertex_count) {
  const auto width = static_cast<std::size_t>(section.keyword->node_count);
  for (std::size_t at = 0; at < section.numbers.size(); ++at) {
    std::int64_t& number = section.numbers[at];
    if (number < 1 || number > static_cast<std::int64_t>(vertex_count)) {
      fail("FORMAT_ERROR", file,
           std::string(section.keyword->name) + ": row " + std::to_string(at / width + 1) +
               " uses vertex " + std::to_string(number) + ", there are only " +
               std::to_string(vertex_count));
    }
    --number;
  }
}

/// The vertices of entity `number`, from 1, of the sections of this name; none: there are fewer.
std::optional<std::span<const std::int64_t>> find_entity(const Model& model, std::string_view name,
                                                         std::int64_t number) {
  for (const Section& section : model.sections) {
    if (section.keyword->name != name) continue;
    const auto width = static_cast<std::size_t>(section.keyword->node_count);
    const auto count = static_cast<std::int64_t>(section.numbers.size() / width);
    if (number >= 1 && number <= count) {
      return std::span(section.numbers)
          .subspan(static_cast<std::size_t>(number - 1) * width, width);
    }
    number -= count;
    if (number < 1) break;
  }
  return std::nullopt;
}

NodeSet kept_nodes(const path& file, const Model& model, const Section& section) {
  const Keyword& keyword = *section.keyword;
  NodeSet set{std::string(keyword.name), {}};
  const auto refuse = [&](std::int64_t number, const std::string& what) {
    fail("FORMAT_ERROR", file,
         set.name + " names number " + std::to_string(number) + " of the " + what +
             ", which is not in the file");
  };
  for (const std::int64_t number : section.numbers) {
    if (keyword.of.empty()) {
      const auto count = static_cast<std::int64_t>(model.fields.positions.size());
      if (number < 1 || number > count) refuse(number, "Vertices");
      set.nodes.push_back(static_cast<NodeId>(number - 1));
      continue;
    }
    const auto nodes = find_entity(model, keyword.of, number);
    if (!nodes) refuse(number, std::string(keyword.of));
    for (const std::int64_t node : *nodes) set.nodes.push_back(static_cast<NodeId>(node));
  }
  return set;
}

void add_set(FileContent& content, NodeSet set) {
  content.fixed_nodes.insert(content.fixed_nodes.end(), set.nodes.begin(), set.nodes.end());
  const auto known = std::ranges::find(content.node_sets, set.name, &NodeSet::name);
  if (known == content.node_sets.end()) {
    content.node_sets.push_back(std::move(set));
  } else {
    known->nodes.insert(known->nodes.end(), set.nodes.begin(), set.nodes.end());
  }
}

/// Programs disagree on the side from which a prism's first triangle is seen: where most of a
/// section are inverted, all are.
bool is_mirrored(const CellKind& kind, const Places& places, const Section& section,
                 const std::vector<Vec3d>& positions) {
  if (kind.vtk_type != kWedgeCell && kind.vtk_type != kWedge18Cell) return false;
  const auto width = static_cast<std::size_t>(kind.node_count);
  std::int64_t sides = 0;
  std::array<std::int64_t, kMaxCellNodes> cell{};
  for (std::size_t first = 0; first < section.numbers.size(); first += width) {
    for (std::size_t node = 0; node < width; ++node) {
      cell[node] = section.numbers[first + places[node]];
    }
    sides += side_of<std::int64_t>(kind, std::span(cell).first(width), positions);
  }
  return sides < 0;
}

void add_cells(const Model& model, const Section& section, PlainDataset& dataset) {
  const Keyword& keyword = *section.keyword;
  const auto width = static_cast<std::size_t>(keyword.node_count);
  const CellKind* kind = find_vtk_cell(keyword.vtk_type);
  const int type = kind == nullptr ? dataset.own_type(keyword.name) : kind->vtk_type;
  const Places places =
      kind == nullptr ? Places{} : find_places(*kind, section.numbers, model.fields.positions);
  const bool mirrored =
      kind != nullptr && is_mirrored(*kind, places, section, model.fields.positions);
  std::vector<std::int64_t> cell(width);
  for (std::size_t first = 0; first < section.numbers.size(); first += width) {
    for (std::size_t node = 0; node < width; ++node) {
      cell[node] = section.numbers[first + (kind == nullptr ? node : places[node])];
    }
    if (mirrored) mirror(*kind, std::span(cell));
    dataset.add_cell(type, cell);
  }
}

/// A file without `End` is whole if all its vertices are used; else it was probably cut off before
/// a section.
void check_end(const path& file, const Model& model) {
  if (model.has_end) return;
  std::vector<std::uint8_t> used(model.fields.positions.size(), 0);
  for (const Section& section : model.sections) {
    if (section.keyword->role != Role::cells) continue;
    for (const std::int64_t node : section.numbers) used[static_cast<std::size_t>(node)] = 1;
  }
  const auto unused = std::ranges::count(used, 0);
  if (unused == 0) return;
  fail("FILE_TRUNCATED", file,
       "there is no End, and " + std::to_string(unused) + " vertices are in no element");
}

Positions positions_of(const Model& model) {
  if (!model.single_precision) return model.fields.positions;
  std::vector<Vec3f> positions;
  positions.reserve(model.fields.positions.size());
  for (const Vec3d& position : model.fields.positions) {
    positions.push_back(vec3_cast<float>(position));
  }
  return positions;
}

}  // namespace

void Model::add_vertex(const std::array<CoordinateFields::Field, 3>& found,
                       const std::array<double, 3>& values) {
  fields.node_ids.push_back(static_cast<std::int64_t>(fields.positions.size()) + 1);
  fields.fields.push_back(found);
  fields.positions.push_back({values[0], values[1], values[2]});
}

void check_supported(const path& file, const Keyword& keyword, std::size_t count) {
  if (count == 0) return;
  fail("ELEMENT_NOT_SUPPORTED", file,
       std::string(keyword.name) +
           " are not read; write polygons and polyhedra as other elements, and all elements with "
           "their nodes in the usual order");
}

void store(const path& file, Model& model, FileContent& content) {
  for (Section& section : model.sections) {
    if (section.keyword->role == Role::cells) {
      resolve_vertices(file, section, model.fields.positions.size());
    }
  }
  check_end(file, model);
  const auto dataset = std::make_shared<PlainDataset>();
  dataset->set_positions(positions_of(model));
  Column references{kReferenceArray, true, {}};
  for (const Section& section : model.sections) {
    if (section.keyword->role == Role::cells) {
      add_cells(model, section, *dataset);
      references.values.insert(references.values.end(), section.references.begin(),
                               section.references.end());
    } else {
      add_set(content, kept_nodes(file, model, section));
    }
  }
  content.cell_ids.resize(references.values.size());
  std::iota(content.cell_ids.begin(), content.cell_ids.end(), 1);
  dataset->add_cell_column(std::move(references));
  if (std::ranges::any_of(model.vertex_references, [](double value) { return value != 0; })) {
    dataset->add_node_column({kReferenceArray, true, model.vertex_references});
  }
  content.node_ids = model.fields.node_ids;
  content.dataset = dataset;
}

}  // namespace meshsmooth::formats::medit
