#include "element_table.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "cells.hpp"
#include "meshsmooth/canonical_topology.hpp"
#include "npz_file.hpp"
#include "readable.hpp"
#include "report/shown_elements.hpp"
#include "text_file.hpp"

namespace meshsmooth::cli {
namespace {

constexpr std::string_view kAll = "all";
constexpr std::array<std::string_view, 3> kStateNames = {"valid", "degenerate", "inverted"};

/// Type and centre of the elements, in the mesh's order.
struct Places {
  std::vector<ElementType> types;
  std::vector<Vec3d> centres;

  explicit Places(const Mesh& mesh) {
    const PositionsView positions = mesh.positions_view();
    for (const ElementBlock& block : mesh.blocks) {
      const auto width = element_width(block.type);
      for (std::size_t at = 0; at < block.nodes.size(); at += width) {
        types.push_back(block.type);
        centres.push_back(centre_of(positions, std::span(block.nodes).subspan(at, width)));
      }
    }
  }
};

/// Calls `visit(id, type, centre, state, element)` for each element.
template <class Visit>
void for_each_row(const formats::MeshFile& file, const ElementTable& table, const Visit& visit) {
  const Places places(file.mesh);
  for (std::size_t e = 0; e < places.types.size(); ++e) {
    visit(file.file_element_id(static_cast<std::int64_t>(e)), element_name(places.types[e]),
          places.centres[e], kStateNames[static_cast<std::size_t>(table.states[e])], e);
  }
}

/// Empty where an element does not have the metric.
std::string as_csv(const formats::MeshFile& file, const ElementTable& table) {
  fmt::memory_buffer text;
  const auto add = [&]<class... Values>(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text), format, std::forward<Values>(values)...);
  };
  add("id,type,x,y,z,state");
  for (const ElementMetric metric : table.metrics) add(",{}", element_metric_name(metric));
  add("\n");
  for_each_row(file, table, [&](auto id, auto type, Vec3d at, auto state, std::size_t e) {
    add("{},{},{},{},{},{}", id, type, at.x, at.y, at.z, state);
    for (const auto& column : table.columns) {
      if (std::isnan(column[e])) {
        add(",");
      } else {
        add(",{}", column[e]);
      }
    }
    add("\n");
  });
  return fmt::to_string(text);
}

std::string json_number(double value) {
  if (std::isnan(value)) return "null";
  if (std::isinf(value)) return value > 0 ? "\"Infinity\"" : "\"-Infinity\"";
  return fmt::format("{}", value);
}

/// One array for each column; null where an element does not have the metric.
std::string as_json(const formats::MeshFile& file, const ElementTable& table) {
  std::vector<std::string> columns = {"\"id\": [", "\"type\": [", "\"x\": [",
                                      "\"y\": [",  "\"z\": [",    "\"state\": ["};
  for_each_row(file, table, [&](auto id, auto type, Vec3d at, auto state, std::size_t e) {
    const char* const comma = e == 0 ? "" : ", ";
    columns[0] += fmt::format("{}{}", comma, id);
    columns[1] += fmt::format("{}\"{}\"", comma, type);
    columns[2] += comma + json_number(at.x);
    columns[3] += comma + json_number(at.y);
    columns[4] += comma + json_number(at.z);
    columns[5] += fmt::format("{}\"{}\"", comma, state);
  });
  for (std::size_t m = 0; m < table.metrics.size(); ++m) {
    std::string& text =
        columns.emplace_back(fmt::format("\"{}\": [", element_metric_name(table.metrics[m])));
    for (std::size_t e = 0; e < table.columns[m].size(); ++e) {
      text += (e == 0 ? "" : ", ") + json_number(table.columns[m][e]);
    }
  }
  std::string text;
  for (const std::string& column : columns) text += (text.empty() ? "{\n" : ",\n") + column + "]";
  return text + "\n}\n";
}

/// Types as VTK's numbers, states as 0 valid, 1 degenerate, 2 inverted, centres as rows.
std::string as_npz(const formats::MeshFile& file, const ElementTable& table) {
  const Places places(file.mesh);
  std::vector<std::int64_t> ids;
  std::vector<std::uint8_t> types, states;
  std::vector<double> centres;
  for (std::size_t e = 0; e < places.types.size(); ++e) {
    ids.push_back(file.file_element_id(static_cast<std::int64_t>(e)));
    types.push_back(static_cast<std::uint8_t>(formats::cell_kind(places.types[e]).vtk_type));
    states.push_back(static_cast<std::uint8_t>(table.states[e]));
    const Vec3d at = places.centres[e];
    centres.insert(centres.end(), {at.x, at.y, at.z});
  }
  NpzFile npz;
  npz.add("id", ids);
  npz.add("type", types);
  npz.add("centre", centres, 3);
  npz.add("state", states);
  for (std::size_t m = 0; m < table.metrics.size(); ++m) {
    npz.add(element_metric_name(table.metrics[m]), table.columns[m]);
  }
  return std::move(npz).bytes();
}

struct ColumnStats {
  std::size_t count = 0;
  double min = 0, percentile_1 = 0, mean = 0, percentile_99 = 0, max = 0;
};

ColumnStats stats_of(std::vector<double> values) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  ColumnStats stats{.count = values.size()};
  if (values.empty()) return stats;
  for (const double value : values) stats.mean += value;
  stats.mean /= static_cast<double>(values.size());
  std::ranges::sort(values);
  stats.min = values.front();
  stats.percentile_1 = values[values.size() / 100];
  stats.percentile_99 = values[values.size() * 99 / 100];
  stats.max = values.back();
  return stats;
}

template <class Visit>
void for_each_shape_metric(const ElementTable& table, const Visit& visit) {
  for (std::size_t m = 0; m < table.metrics.size(); ++m) {
    if (!std::holds_alternative<ShapeMetric>(table.metrics[m])) continue;
    visit(std::string(element_metric_name(table.metrics[m])), stats_of(table.columns[m]));
  }
}

}  // namespace

void add_element_table_flags(CLI::App& command, ElementTableFlags& flags) {
  std::vector<std::string> names = {std::string(kAll)};
  std::string shapes;
  for (const ElementMetric metric : element_metrics()) {
    names.emplace_back(element_metric_name(metric));
    if (std::holds_alternative<ShapeMetric>(metric)) shapes += names.back() + ", ";
  }
  command
      .add_option("--metrics", flags.metrics,
                  "Further metrics for the table, the files and the cell arrays, separated by "
                  "commas: " +
                      shapes + "or all")
      ->delimiter(',')
      ->check(CLI::IsMember(names).description(""))
      ->allow_extra_args(false);
  command
      .add_option("--require", flags.requirements,
                  "Requirement, such as \"min scaled_jacobian >= 0.2\" or \"inverted == 0\": min, "
                  "max, mean or percentile_N (none: every element) of a metric, or a count "
                  "(inverted, degenerate, elements), against a number; exit code 6 if it is not "
                  "met; may be repeated")
      ->allow_extra_args(false);
  command.add_option("--csv", flags.csv, "File for a row per element: id, type, centre, metrics");
  command.add_option("--npz", flags.npz, "The same as named arrays, for numpy.load");
  command.add_option("--elements-json", flags.json, "The same as JSON, an array per column");
}

std::vector<Requirement> check_element_table(const ElementTableFlags& flags) {
  std::vector<Requirement> requirements;
  for (const std::string& text : flags.requirements) {
    requirements.push_back(parse_requirement(text));
  }
  for (const auto* path : {&flags.csv, &flags.npz, &flags.json}) {
    if (*path) check_text_file_writable(**path);
  }
  return requirements;
}

std::vector<ElementMetric> table_metrics(const ElementTableFlags& flags,
                                         const std::vector<Requirement>& requirements,
                                         const Mesh& mesh) {
  const auto wanted = [&](ElementMetric metric) {
    if (std::holds_alternative<QualityMetric>(metric)) {
      return std::ranges::any_of(mesh.blocks, [&](const ElementBlock& block) {
        return has_element_metric(block.type, metric);
      });
    }
    return std::ranges::any_of(flags.metrics, [&](const std::string& name) {
      return name == kAll || name == element_metric_name(metric);
    });
  };
  const auto required = [&](ElementMetric metric) {
    return std::ranges::find(requirements, metric, metric_of) != requirements.end();
  };
  std::vector<ElementMetric> metrics = element_metrics();
  std::erase_if(metrics,
                [&](ElementMetric metric) { return !wanted(metric) && !required(metric); });
  return metrics;
}

ElementTable measure_table(const Mesh& mesh, std::vector<ElementMetric> metrics) {
  const MeshTopology topology(mesh);
  const PositionsView positions = mesh.positions_view();
  const CanonicalTopology canonical(topology.view(), positions);
  ElementTable table =
      tabulate_elements(canonical.view(), positions,
                        SurfaceOrientation(canonical.view(), positions), std::move(metrics));
  for (auto& column : table.columns) {
    column = canonical.in_caller_order(std::span<const double>(column),
                                       std::numeric_limits<double>::quiet_NaN());
  }
  table.states =
      canonical.in_caller_order(std::span<const ElementState>(table.states), ElementState::valid);
  return table;
}

void write_element_table(const ElementTableFlags& flags, const formats::MeshFile& file,
                         const ElementTable& table) {
  if (flags.csv) write_text_file(*flags.csv, as_csv(file, table));
  if (flags.npz) write_text_file(*flags.npz, as_npz(file, table));
  if (flags.json) write_text_file(*flags.json, as_json(file, table));
}

std::string describe_table(const ElementTable& table) {
  std::string text;
  for_each_shape_metric(table, [&](std::string name, const ColumnStats& stats) {
    if (text.empty()) {
      text = fmt::format("\n{:<19} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "", "min", "1 %", "mean",
                         "99 %", "max");
    }
    std::ranges::replace(name, '_', ' ');
    if (stats.count == 0) {
      text += fmt::format("{:<19} no element has it\n", name);
      return;
    }
    text += fmt::format("{:<19} {:>9.4g} {:>9.4g} {:>9.4g} {:>9.4g} {:>9.4g}\n", name, stats.min,
                        stats.percentile_1, stats.mean, stats.percentile_99, stats.max);
  });
  if (table.faces) {
    text += fmt::format(
        "{} between elements: non-orthogonality max {:.6g}, average {:.6g} degrees; "
        "skewness of all faces max {:.6g}\n",
        counted(table.faces->internal_face_count, "face"), table.faces->max_non_orthogonality,
        table.faces->average_non_orthogonality, table.faces->max_skewness);
  }
  return text;
}

std::string table_json(const ElementTable& table) {
  std::string text;
  for_each_shape_metric(table, [&](const std::string& name, const ColumnStats& stats) {
    text += fmt::format("{}{{\"metric\": \"{}\", \"element_count\": {}", text.empty() ? "" : ", ",
                        name, stats.count);
    if (stats.count > 0) {
      text += fmt::format(
          ", \"min\": {}, \"percentile_1\": {}, \"mean\": {}, \"percentile_99\": {}, \"max\": {}",
          json_number(stats.min), json_number(stats.percentile_1), json_number(stats.mean),
          json_number(stats.percentile_99), json_number(stats.max));
    }
    text += "}";
  });
  text = "\"shape_metrics\": [" + text + "]";
  if (!table.faces) return text;
  return text + fmt::format(
                    ",\"faces\": {{\"internal_face_count\": {}, \"max_non_orthogonality\": {}, "
                    "\"average_non_orthogonality\": {}, \"max_skewness\": {}}}",
                    table.faces->internal_face_count, table.faces->max_non_orthogonality,
                    table.faces->average_non_orthogonality, table.faces->max_skewness);
}

std::string describe_requirement(const Requirement& requirement, const RequirementResult& result,
                                 const formats::MeshFile& file) {
  if (result.met) return fmt::format("met      {}: {}\n", requirement.text, result.value);
  std::string text = fmt::format("NOT MET  {}: {}", requirement.text, result.value);
  if (requirement.subject == Requirement::Subject::elements) return text + "\n";
  text += fmt::format(", {} of {}\n", with_commas(result.breaking_count),
                      counted(result.element_count, "element"));
  const Places places(file.mesh);
  for (const auto& [element, value] : result.worst) {
    const auto e = static_cast<std::size_t>(element);
    const Vec3d at = places.centres[e];
    text += fmt::format("  element {} ({}) at ({:.6g}, {:.6g}, {:.6g}): {} {:.6g}\n",
                        file.file_element_id(element), element_name(places.types[e]), at.x, at.y,
                        at.z, element_metric_name(metric_of(requirement)), value);
  }
  return text;
}

}  // namespace meshsmooth::cli
