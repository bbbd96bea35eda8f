#include "gpu/pipeline_report.hpp"

#include <ostream>
#include <sstream>

namespace meshsmooth::bench {
namespace {

std::string or_dash(const std::optional<double>& value) { return value ? number(*value) : "-"; }

std::string megabytes(std::int64_t bytes) { return number(static_cast<double>(bytes) * 1e-6); }

void print_pipeline(std::ostream& out, const PipelineReport& report) {
  out << "\nPipeline: smooth() from and to page-locked memory, medians, ms; tolerance 1e-4, form "
         "A,\n"
         "no guard. The wall time has everything, also evaluating the mesh before and after.\n";
  Table table({"mesh", "type", "tetrahedra", "wall", "up", "neighbours", "boundary", "iterate",
               "down", "evaluate", "sweeps", "inverted", "device MB"});
  for (const MeshFigures& m : report.meshes) {
    const auto add = [&](const char* type, const std::optional<ProductFigures>& f) {
      if (!f) return;
      table.add({m.mesh, type, std::to_string(m.tetrahedron_count), number(f->wall_ms),
                 number(f->upload_ms), number(f->neighbours_ms), number(f->boundary_ms),
                 number(f->iterate_ms), number(f->download_ms), number(f->evaluate_ms),
                 std::to_string(f->summary.convergence.iteration_count),
                 std::to_string(f->summary.quality_after.inverted_count),
                 megabytes(f->summary.device_peak_bytes)});
    };
    add("f32", m.product);
    add("f64", m.product_double);
    add("f32 CPU", m.cpu);
  }
  table.print(out);

  out << "\nThe same work by others, wall ms, and how many times faster the product (f32) is\n";
  Table others({"mesh", "product", "less evaluation", "paper's best", "variant", "faster",
                "faster less evaluation", "serial A", "faster", "CPU backend", "faster"});
  for (const MeshFigures& m : report.meshes) {
    if (!m.product) continue;
    const double wall = m.product->wall_ms;
    const double no_evaluation = wall - m.product->evaluate_ms;
    std::vector<std::string> row = {m.mesh, number(wall), number(no_evaluation)};
    if (m.paper && !m.paper->gpu.variants.empty()) {
      const VariantFigures& best = m.paper->gpu.best();
      const double serial = m.paper->serial.total_ms(IterationForm::a);
      row.insert(row.end(),
                 {number(best.pooled.wall),
                  std::string(name_of(best.variant.form)) + " " +
                      std::string(name_of(best.variant.layout)) + " x" +
                      std::to_string(best.variant.block_count),
                  ratio(best.pooled.wall / wall), ratio(best.pooled.wall / no_evaluation),
                  number(serial), ratio(serial / wall)});
    } else {
      row.insert(row.end(), 6, "-");
    }
    row.push_back(m.cpu ? number(m.cpu->wall_ms) : "-");
    row.push_back(m.cpu ? ratio(m.cpu->wall_ms / wall) : "-");
    others.add(row);
  }
  others.print(out);

  out << "\nNeighbours and boundary, ms (paper: Thrust's sorts, memory pooled)\n";
  Table topology({"mesh", "product", "peak MB of the job", "paper", "paper's peak MB", "faster"});
  for (const MeshFigures& m : report.meshes) {
    if (!m.product) continue;
    const double ours = m.product->neighbours_ms + m.product->boundary_ms;
    double paper = 0;
    std::size_t peak = m.paper_peak_bytes;
    if (m.paper_topology) paper = m.paper_topology->neighbours + m.paper_topology->boundary;
    if (m.paper && !m.paper->gpu.variants.empty()) {
      const StageMilliseconds& best = m.paper->gpu.best().pooled;
      paper = best.neighbours + best.boundary;
      peak = m.paper->gpu.peak_bytes;
    }
    topology.add({m.mesh, number(ours), megabytes(m.product->summary.device_peak_bytes),
                  paper > 0 ? number(paper) : "-",
                  paper > 0 ? megabytes(static_cast<std::int64_t>(peak)) : "-",
                  paper > 0 ? ratio(paper / ours) : "-"});
  }
  topology.print(out);
}

void print_sweeps(std::ostream& out, const PipelineReport& report) {
  out << "\nOne Jacobi sweep, us. Device copy, read + write: "
      << number(report.copy_bandwidth * 1e-12)
      << " TB/s.\nCompulsory bytes: 4 per id in the rings of moving nodes, 4 per node, positions "
         "read and\nwritten once. Peers: no test of convergence, the quicker of launches and a "
         "graph.\n";
  Table table({"mesh", "f32", "MB", "TB/s", "of copy", "f64", "f64/f32", "CPU backend",
               "best cuSPARSE", "which", "faster", "scatter-add", "faster"});
  for (const MeshFigures& m : report.meshes) {
    if (!m.sweep_us) continue;
    const double rate = m.sweep_bytes / (*m.sweep_us * 1e-6);
    const PeerSweep* const cusparse = m.best_cusparse();
    std::ostringstream share;
    share << number(100 * rate / report.copy_bandwidth) << " %";
    table.add({m.mesh, number(*m.sweep_us), number(m.sweep_bytes * 1e-6), number(rate * 1e-12),
               report.copy_bandwidth > 0 ? share.str() : "-", or_dash(m.sweep_double_us),
               m.sweep_double_us ? ratio(*m.sweep_double_us / *m.sweep_us) : "-",
               or_dash(m.cpu_sweep_us), cusparse ? number(cusparse->microseconds) : "-",
               cusparse ? cusparse->name : "-",
               cusparse ? ratio(cusparse->microseconds / *m.sweep_us) : "-",
               m.scatter ? number(m.scatter->microseconds) : "-",
               m.scatter ? ratio(m.scatter->microseconds / *m.sweep_us) : "-"});
  }
  table.print(out);
  Table peers({"mesh", "peer", "us", "difference"});
  for (const MeshFigures& m : report.meshes) {
    for (const PeerSweep& peer : m.cusparse) {
      peers.add({m.mesh, peer.name, peer.skipped.empty() ? number(peer.microseconds) : "skipped",
                 peer.skipped.empty() ? number(peer.largest_difference) : "-"});
    }
  }
  out << '\n';
  peers.print(out);
}

void print_optimize(std::ostream& out, const PipelineReport& report) {
  out << "\nOptimize, balanced, f32: until the mean of the mean ratio is within 0.1 % of the\n"
         "converged one, and from 40 % inverted tetrahedra to none. Sweeps: without colouring and\n"
         "what else comes before them. All: copies, neighbours, colouring and evaluation too.\n";
  Table table({"mesh", "goal", "inverted", "sweeps", "sweeps ms", "iterate ms", "all ms",
               "paper's best / all", "mean ratio", "worst", "from CPU's"});
  for (const MeshFigures& m : report.meshes) {
    if (!m.optimize) continue;
    const auto add = [&](const char* goal, const OptimizeRun& run) {
      const bool paper = m.paper && !m.paper->gpu.variants.empty();
      table.add({m.mesh, goal, std::to_string(run.inverted_before),
                 std::to_string(run.figures.summary.convergence.iteration_count),
                 number(run.sweeps_ms), number(run.figures.iterate_ms), number(run.figures.wall_ms),
                 paper ? ratio(m.paper->gpu.best().pooled.wall / run.figures.wall_ms) : "-",
                 number(run.mean_ratio), number(run.worst_ratio),
                 or_dash(m.optimize->cpu_difference)});
    };
    add("converged", m.optimize->to_converged);
    add("untangled", m.optimize->to_untangled);
  }
  table.print(out);
}

void print_rest(std::ostream& out, const PipelineReport& report) {
  if (!report.methods.empty()) {
    out << "\nMethods on the 100k cube, " << report.method_sweeps
        << " sweeps, guarded unless said, ms\n";
    Table table({"method", "wall", "iterate", "evaluate", "sweeps", "colours", "inverted"});
    for (const MethodFigures& method : report.methods) {
      if (!method.figures) {
        table.add({method.name, "failed"});
        continue;
      }
      const SmoothSummary& summary = method.figures->summary;
      table.add({method.name, number(method.figures->wall_ms), number(method.figures->iterate_ms),
                 number(method.figures->evaluate_ms),
                 std::to_string(summary.convergence.iteration_count),
                 std::to_string(summary.colour_count),
                 std::to_string(summary.quality_after.inverted_count)});
    }
    table.print(out);
  }
  if (!report.lanes.empty()) {
    out << "\nLanes: threads with a smoother each, 5k cube\n";
    Table table({"lanes", "jobs", "jobs/s", "of one lane", "jobs with other bits"});
    for (const LaneFigures& lane : report.lanes) {
      table.add({std::to_string(lane.lane_count), std::to_string(lane.job_count),
                 number(lane.jobs_per_second),
                 ratio(lane.jobs_per_second / report.lanes.front().jobs_per_second),
                 std::to_string(lane.different_count)});
    }
    table.print(out);
  }
}

Json to_json(const PeerSweep& peer) {
  Json json;
  json.set("name", peer.name);
  if (!peer.skipped.empty()) return json.set("skipped", peer.skipped);
  return json.set("sweep_us", peer.microseconds).set("largest_difference", peer.largest_difference);
}

Json to_json(const MeshFigures& m) {
  Json json;
  json.set("mesh", m.mesh).set("nodes", m.node_count).set("tetrahedra", m.tetrahedron_count);
  if (m.product) json.set("product_float32", to_json(*m.product));
  if (m.product_double) json.set("product_float64", to_json(*m.product_double));
  if (m.cpu) json.set("cpu_backend", to_json(*m.cpu));
  if (m.sweep_us) json.set("sweep_float32_us", *m.sweep_us);
  if (m.sweep_double_us) json.set("sweep_float64_us", *m.sweep_double_us);
  if (m.cpu_sweep_us) json.set("sweep_cpu_us", *m.cpu_sweep_us);
  if (m.sweep_bytes > 0) json.set("sweep_float32_bytes", m.sweep_bytes);
  if (m.sweep_double_bytes > 0) json.set("sweep_float64_bytes", m.sweep_double_bytes);
  if (m.paper) json.set("paper", to_json(*m.paper));
  if (m.paper_topology) {
    Json paper;
    paper.set("neighbours_ms", m.paper_topology->neighbours)
        .set("boundary_ms", m.paper_topology->boundary)
        .set("peak_bytes", m.paper_peak_bytes);
    json.set("paper_topology", std::move(paper));
  }
  Json cusparse;
  for (const PeerSweep& peer : m.cusparse) cusparse.push(to_json(peer));
  json.set("cusparse", std::move(cusparse));
  if (m.scatter) json.set("scatter_add", to_json(*m.scatter));
  if (m.optimize) json.set("optimize", to_json(*m.optimize));
  return json;
}

}  // namespace

const PeerSweep* MeshFigures::best_cusparse() const {
  const PeerSweep* best = nullptr;
  for (const PeerSweep& peer : cusparse) {
    if (peer.skipped.empty() && (best == nullptr || peer.microseconds < best->microseconds)) {
      best = &peer;
    }
  }
  return best;
}

void print(std::ostream& out, const PipelineReport& report) {
  print_pipeline(out, report);
  print_sweeps(out, report);
  print_optimize(out, report);
  print_rest(out, report);
}

Json to_json(const PipelineReport& report) {
  Json meshes, methods, lanes, errors;
  for (const MeshFigures& m : report.meshes) meshes.push(to_json(m));
  for (const MethodFigures& method : report.methods) {
    Json entry;
    entry.set("method", method.name);
    if (method.figures) entry.set("figures", to_json(*method.figures));
    methods.push(std::move(entry));
  }
  for (const LaneFigures& lane : report.lanes) {
    Json entry;
    entry.set("lanes", lane.lane_count)
        .set("jobs", lane.job_count)
        .set("jobs_per_second", lane.jobs_per_second)
        .set("jobs_with_other_bits", lane.different_count);
    lanes.push(std::move(entry));
  }
  for (const std::string& error : report.errors) errors.push(error);
  Json json;
  return json.set("benchmark", "pipeline")
      .set("device", to_json(report.device))
      .set("repeats", report.repeats)
      .set("copy_bytes_per_second", report.copy_bandwidth)
      .set("meshes", std::move(meshes))
      .set("methods", std::move(methods))
      .set("lanes", std::move(lanes))
      .set("errors", std::move(errors));
}

}  // namespace meshsmooth::bench
