#include "paper/tables.hpp"

#include <functional>
#include <ostream>
#include <string>

#include "paper/published.hpp"

namespace meshsmooth::bench {
namespace {

std::string published_number(const std::string& mesh, const std::string& quantity) {
  const auto value = published::find(mesh, quantity);
  return value ? number(*value) : "-";
}

std::string variant_name(const VariantFigures& figures) {
  return std::string(name_of(figures.variant.form)) + " " +
         std::string(name_of(figures.variant.layout)) +
         (figures.many_blocks() ? " many" : " single");
}

void print_meshes(std::ostream& out, const std::vector<PaperFigures>& meshes) {
  out << "\nTable 2. Meshes\n";
  Table table({"mesh", "nodes", "boundary nodes", "tetrahedra", "paper", "mean ring"});
  for (const PaperFigures& m : meshes) {
    table.add({m.mesh, std::to_string(m.node_count), std::to_string(m.boundary_count),
               std::to_string(m.tetrahedron_count), published_number(m.mesh, "tetrahedra"),
               number(static_cast<double>(m.entry_count) / static_cast<double>(m.node_count))});
  }
  table.print(out);
}

void print_serial(std::ostream& out, const std::vector<PaperFigures>& meshes) {
  out << "\nTable 3. Serial algorithm on one core, ms\n";
  Table table({"mesh", "neighbours", "boundary", "iterate A", "sweeps A", "iterate B", "sweeps B",
               "total A", "paper", "total B", "paper", "paper, form not stated here"});
  for (const PaperFigures& m : meshes) {
    const SerialFigures& s = m.serial;
    table.add({m.mesh, number(s.neighbours_ms), number(s.boundary_ms), number(s.form_a_ms),
               std::to_string(s.form_a_sweeps), number(s.form_b_ms),
               std::to_string(s.form_b_sweeps), number(s.total_ms(IterationForm::a)),
               published_number(m.mesh, "serial A"), number(s.total_ms(IterationForm::b)),
               published_number(m.mesh, "serial B"), published_number(m.mesh, "best serial")});
  }
  table.print(out);
}

/// One row a mesh, for each of the six variants with single or many blocks our
/// figure and the published one.
void print_variants(
    std::ostream& out, const std::vector<PaperFigures>& meshes, bool many,
    const std::string& published_suffix,
    const std::function<double(const PaperFigures&, const VariantFigures&)>& value) {
  std::vector<std::string> header = {"mesh"};
  for (const VariantFigures& variant : meshes.front().gpu.variants) {
    if (variant.many_blocks() != many) continue;
    header.push_back(std::string(name_of(variant.variant.form)) + " " +
                     std::string(name_of(variant.variant.layout)));
    header.push_back("paper");
  }
  Table table(header);
  for (const PaperFigures& m : meshes) {
    std::vector<std::string> row = {m.mesh};
    for (const VariantFigures& variant : m.gpu.variants) {
      if (variant.many_blocks() != many) continue;
      row.push_back(number(value(m, variant)));
      row.push_back(published_number(m.mesh, variant_name(variant) + published_suffix));
    }
    table.add(row);
  }
  table.print(out);
}

double stages(const PaperFigures&, const VariantFigures& variant) { return variant.stages_ms(); }

double speedup(const PaperFigures& mesh, const VariantFigures& variant) {
  return mesh.serial.total_ms(variant.variant.form) / variant.stages_ms();
}

void print_neighbours(std::ostream& out, const std::vector<PaperFigures>& meshes) {
  out << "\nFigure 6. Neighbours, ms (GPU: medians over all runs of the best variant)\n";
  Table table({"mesh", "serial", "GPU pooled", "GPU plain", "serial / pooled", "boundary serial",
               "boundary pooled", "boundary plain", "peak MB"});
  for (const PaperFigures& m : meshes) {
    const VariantFigures& best = m.gpu.best();
    const bool plain = best.plain.wall > 0;
    table.add({m.mesh, number(m.serial.neighbours_ms), number(best.pooled.neighbours),
               plain ? number(best.plain.neighbours) : "-",
               ratio(m.serial.neighbours_ms / best.pooled.neighbours), number(m.serial.boundary_ms),
               number(best.pooled.boundary), plain ? number(best.plain.boundary) : "-",
               number(static_cast<double>(m.gpu.peak_bytes) * 1e-6)});
  }
  table.print(out);
}

void print_iterations(std::ostream& out, const std::vector<PaperFigures>& meshes, bool many) {
  out << "\nFigure " << (many ? "10. Iterations with many blocks" : "9. Iterations with one block")
      << ", ms (sweeps of the slowest block" << (many ? ", blocks" : "") << ")\n";
  std::vector<std::string> header = {"mesh", "serial A", "serial B"};
  for (const VariantFigures& variant : meshes.front().gpu.variants) {
    if (variant.many_blocks() == many) header.push_back(variant_name(variant));
  }
  Table table(header);
  for (const PaperFigures& m : meshes) {
    std::vector<std::string> row = {
        m.mesh, number(m.serial.form_a_ms) + " (" + std::to_string(m.serial.form_a_sweeps) + ")",
        number(m.serial.form_b_ms) + " (" + std::to_string(m.serial.form_b_sweeps) + ")"};
    for (const VariantFigures& variant : m.gpu.variants) {
      if (variant.many_blocks() != many) continue;
      row.push_back(number(variant.pooled.iterate) + " (" + std::to_string(variant.most_sweeps) +
                    (many ? ", " + std::to_string(variant.variant.block_count) : "") + ")");
    }
    table.add(row);
  }
  table.print(out);
}

void print_form_b_over_a(std::ostream& out, const std::vector<PaperFigures>& meshes) {
  out << "\nFigure 8. Form B over form A: time of A's iterations over B's\n";
  Table table({"mesh", "serial", "single AoS", "single aligned AoS", "single SoA", "many AoS",
               "many aligned AoS", "many SoA"});
  for (const PaperFigures& m : meshes) {
    std::vector<std::string> row = {m.mesh, ratio(m.serial.form_a_ms / m.serial.form_b_ms)};
    for (const bool many : {false, true}) {
      for (const Layout layout : kLayouts) {
        double a = 0, b = 0;
        for (const VariantFigures& variant : m.gpu.variants) {
          if (variant.many_blocks() != many || variant.variant.layout != layout) continue;
          (variant.variant.form == IterationForm::a ? a : b) = variant.pooled.iterate;
        }
        row.push_back(ratio(a / b));
      }
    }
    table.add(row);
  }
  table.print(out);
}

void print_whole_runs(std::ostream& out, const std::vector<PaperFigures>& meshes) {
  out << "\nWhole runs from page-locked to page-locked host memory, copies included, wall ms\n";
  Table table({"mesh", "variant", "blocks", "up", "neighbours", "boundary", "iterate", "down",
               "wall pooled", "wall plain", "serial / wall"});
  for (const PaperFigures& m : meshes) {
    for (const VariantFigures& v : m.gpu.variants) {
      table.add({m.mesh, variant_name(v) + (&v == &m.gpu.best() ? " *" : ""),
                 std::to_string(v.variant.block_count), number(v.pooled.upload),
                 number(v.pooled.neighbours), number(v.pooled.boundary), number(v.pooled.iterate),
                 number(v.pooled.download), number(v.pooled.wall),
                 v.plain.wall > 0 ? number(v.plain.wall) : "-",
                 ratio(m.serial.total_ms(v.variant.form) / v.pooled.wall)});
    }
  }
  table.print(out);
  out << "* the best of the twelve\n";
}

void add_finding(Table& table, const PaperFigures& m, const std::string& name, int sweeps,
                 const Findings& found, const std::string& converged, const std::string& bits) {
  const double times_tolerance = found.largest_move / m.tolerance;
  table.add({m.mesh, name, std::to_string(sweeps), number(times_tolerance),
             times_tolerance > 1 ? "NO" : "yes", std::to_string(found.inverted_count),
             number(100.0 * static_cast<double>(found.inverted_count) /
                    static_cast<double>(m.tetrahedron_count)),
             converged, bits});
}

void print_findings(std::ostream& out, const std::vector<PaperFigures>& meshes) {
  out << "\nFindings: what the results are energy (worst over all runs)\n";
  Table table({"mesh", "result", "sweeps", "next move / tolerance", "kept", "inverted", "%",
               "converged", "same bits"});
  for (const PaperFigures& m : meshes) {
    add_finding(table, m, "input", 0, m.before, "-", "-");
    add_finding(table, m, "serial A", m.serial.form_a_sweeps, m.serial.form_a, "yes", "-");
    add_finding(table, m, "serial B", m.serial.form_b_sweeps, m.serial.form_b, "yes", "-");
    for (const VariantFigures& v : m.gpu.variants) {
      add_finding(table, m, variant_name(v), v.most_sweeps, v.worst, v.converged ? "yes" : "NO",
                  v.same_bits ? "yes" : "NO");
    }
  }
  table.print(out);
}

}  // namespace

void print_tables(std::ostream& out, const std::vector<PaperFigures>& meshes) {
  out << "\nPaper: " << published::kMachine
      << ". A \"-\" is a figure that was not available, not a zero.\n"
         "Times of Tables 3 to 7 are neighbours + boundary + iterations, without copies; ours\n"
         "are medians, on the GPU by CUDA events and with pooled memory.\n";
  print_meshes(out, meshes);
  print_serial(out, meshes);
  if (!meshes.front().gpu.variants.empty()) {
    out << "\nTable 4. GPU, one block, ms\n";
    print_variants(out, meshes, false, "", stages);
    out << "\nTable 5. GPU, many blocks (the fastest number of them), ms\n";
    print_variants(out, meshes, true, "", stages);
    out << "\nTable 6. Speed-up over the serial algorithm of the same form, one block\n";
    print_variants(out, meshes, false, " speedup", speedup);
    out << "\nTable 7. Speed-up over the serial algorithm of the same form, many blocks\n";
    print_variants(out, meshes, true, " speedup", speedup);
    print_neighbours(out, meshes);
    print_form_b_over_a(out, meshes);
    print_iterations(out, meshes, false);
    print_iterations(out, meshes, true);
    print_whole_runs(out, meshes);
  }
  print_findings(out, meshes);
}

}  // namespace meshsmooth::bench
