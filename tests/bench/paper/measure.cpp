#include "paper/measure.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <iostream>
#include <limits>
#include <sstream>

#include "meshsmooth/quality.hpp"

namespace meshsmooth::bench {
namespace {

/// How far the positions of form A may differ from the serial ones.
constexpr double kAgreement = 1e-5;

template <class Body>
double milliseconds_of(const Body& body) {
  const auto begin = std::chrono::steady_clock::now();
  body();
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - begin;
  return elapsed.count();
}

bool same_bits(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Vec3f)) == 0;
}

std::string describe(const Variant& variant) {
  std::ostringstream text;
  text << "form " << name_of(variant.form) << ", " << name_of(variant.layout) << ", "
       << variant.block_count << (variant.block_count == 1 ? " block" : " blocks");
  return text.str();
}

class Samples {
 public:
  void add(const StageMilliseconds& times) { runs_.push_back(times); }
  [[nodiscard]] StageMilliseconds medians() const {
    return {of(&StageMilliseconds::upload),   of(&StageMilliseconds::neighbours),
            of(&StageMilliseconds::boundary), of(&StageMilliseconds::iterate),
            of(&StageMilliseconds::download), of(&StageMilliseconds::wall)};
  }

 private:
  [[nodiscard]] double of(double StageMilliseconds::*stage) const {
    std::vector<double> values;
    for (const StageMilliseconds& run : runs_) values.push_back(run.*stage);
    return median(values);
  }
  std::vector<StageMilliseconds> runs_;
};

SerialFigures measure_serial(const BenchMesh& mesh, const PaperSettings& settings,
                             HostTopology& host, SerialResult& form_a) {
  constexpr std::size_t kLargeMesh = 500'000;
  const int repeats = mesh.node_count() >= kLargeMesh ? 1 : std::min(settings.repeats, 3);
  std::vector<double> neighbours, boundary, times_a, times_b;
  SerialResult form_b;
  const std::vector<Vec3f> positions = mesh.float_positions();
  for (int run = 0; run < repeats; ++run) {
    neighbours.push_back(milliseconds_of(
        [&] { host.rings = find_neighbours_serial(mesh.node_count(), mesh.tetrahedra); }));
    boundary.push_back(milliseconds_of(
        [&] { host.boundary = find_boundary_serial(mesh.node_count(), mesh.tetrahedra); }));
    times_a.push_back(milliseconds_of([&] {
      form_a = smooth_form_a(host.rings, host.boundary, positions, settings.tolerance,
                             PaperSystem::kMostSweeps);
    }));
    times_b.push_back(milliseconds_of([&] {
      form_b = smooth_form_b(host.rings, host.boundary, positions, settings.tolerance,
                             PaperSystem::kMostSweeps);
    }));
  }
  return {median(neighbours),
          median(boundary),
          median(times_a),
          median(times_b),
          form_a.sweep_count,
          form_b.sweep_count,
          evaluate(mesh, host, form_a.positions),
          evaluate(mesh, host, form_b.positions)};
}

/// Powers of two below the number of multiprocessors, and that number.
std::vector<int> block_counts() {
  int device = 0, multiprocessors = 0;
  check_cuda(cudaGetDevice(&device), "asking for the device");
  check_cuda(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device),
             "asking for the number of multiprocessors");
  std::vector<int> counts;
  for (int count = 2; count < multiprocessors; count *= 2) counts.push_back(count);
  counts.push_back(multiprocessors);
  return counts;
}

class GpuMeasurement {
 public:
  GpuMeasurement(const BenchMesh& mesh, const PaperSettings& settings, const HostTopology& host,
                 const SerialResult& form_a, std::vector<std::string>& errors)
      : mesh_(mesh),
        settings_(settings),
        host_(host),
        form_a_(form_a),
        errors_(errors),
        system_(mesh, settings.tolerance, stream_),
        pooled_(Memory::pooled, stream_),
        plain_(Memory::plain, stream_) {}

  GpuFigures measure() {
    GpuFigures figures;
    StageMilliseconds unused;
    pooled_.restart_peak();
    topology_ = system_.make_topology(pooled_, unused);
    figures.peak_bytes = pooled_.peak_bytes();
    check_topology();
    const std::vector<int> many = block_counts();
    for (const IterationForm form : kForms) {
      for (const Layout layout : kLayouts) {
        figures.variants.push_back(measure_variant({form, layout, 1}, {1}));
        figures.variants.push_back(measure_variant({form, layout, many.back()}, many));
      }
    }
    return figures;
  }

 private:
  void check_topology() {
    const HostTopology found = download_topology(topology_, stream_);
    if (found.rings.starts != host_.rings.starts || found.rings.entries != host_.rings.entries) {
      errors_.push_back(mesh_.name + ": neighbours of the GPU differ from the serial ones");
    }
    if (found.boundary != host_.boundary) {
      errors_.push_back(mesh_.name + ": boundary of the GPU differs from the serial one");
    }
  }

  /// Form A on one block is the serial form A; only the rounding may differ.
  void check_positions(const Variant& variant, const SystemRun& run) {
    if (variant.form != IterationForm::a || variant.block_count != 1) return;
    // Rounding may put the end one sweep off where the last move is close to
    // the tolerance.
    const bool same_length = run.most_sweeps == form_a_.sweep_count;
    const SerialResult as_long = same_length
                                     ? SerialResult{}
                                     : smooth_form_a(host_.rings, host_.boundary,
                                                     mesh_.float_positions(), 0, run.most_sweeps);
    const double difference =
        largest_difference(run.positions, same_length ? form_a_.positions : as_long.positions);
    if (difference <= kAgreement && std::abs(run.most_sweeps - form_a_.sweep_count) <= 1) return;
    std::ostringstream text;
    text << mesh_.name << ": " << describe(variant) << " differs from the serial form A by "
         << difference << " after " << run.most_sweeps << " sweeps (serial: " << form_a_.sweep_count
         << ")";
    errors_.push_back(text.str());
  }

  void note(VariantFigures& figures, const SystemRun& run, std::vector<Vec3f>& first) {
    figures.least_sweeps = run.least_sweeps;
    figures.most_sweeps = run.most_sweeps;
    figures.converged = figures.converged && run.most_sweeps < PaperSystem::kMostSweeps;
    if (first.empty()) {
      first = run.positions;
    } else if (same_bits(first, run.positions)) {
      return;  // evaluated already
    } else {
      figures.same_bits = false;
    }
    const Findings found = evaluate(mesh_, host_, run.positions);
    figures.worst.largest_move = std::max(figures.worst.largest_move, found.largest_move);
    figures.worst.inverted_count = std::max(figures.worst.inverted_count, found.inverted_count);
  }

  VariantFigures measure_variant(Variant variant, const std::vector<int>& counts) {
    VariantFigures figures;
    double fastest = std::numeric_limits<double>::infinity();
    for (const int count : counts) {
      Variant tried = variant;
      tried.block_count = count;
      std::vector<double> times;
      static_cast<void>(system_.run_sweeps(pooled_, topology_, tried));  // warm-up
      for (int run = 0; run < 3; ++run) {
        times.push_back(system_.run_sweeps(pooled_, topology_, tried).times.iterate);
      }
      figures.block_counts.push_back({count, median(times)});
      if (figures.block_counts.back().iterate_ms < fastest) {
        fastest = figures.block_counts.back().iterate_ms;
        variant = tried;
      }
    }
    figures.variant = variant;

    std::vector<Vec3f> first;
    figures.pooled = measure_runs(pooled_, figures, first);
    if (settings_.with_plain_memory) figures.plain = measure_runs(plain_, figures, first);
    return figures;
  }

  StageMilliseconds measure_runs(DeviceHeap& heap, VariantFigures& figures,
                                 std::vector<Vec3f>& first) {
    Samples samples;
    for (int run = -1; run < settings_.repeats; ++run) {
      const SystemRun result = system_.run(heap, figures.variant);
      note(figures, result, first);
      if (run == -1) {
        check_positions(figures.variant, result);
      } else {
        samples.add(result.times);
      }
    }
    return samples.medians();
  }

  const BenchMesh& mesh_;
  const PaperSettings& settings_;
  const HostTopology& host_;
  const SerialResult& form_a_;
  std::vector<std::string>& errors_;
  Stream stream_;
  PaperSystem system_;
  DeviceHeap pooled_;
  DeviceHeap plain_;
  DeviceTopology topology_;
};

Json to_json(const Findings& findings) {
  Json json;
  json.set("largest_move", findings.largest_move).set("inverted", findings.inverted_count);
  return json;
}

Json to_json(const StageMilliseconds& times) {
  Json json;
  json.set("upload_ms", times.upload)
      .set("neighbours_ms", times.neighbours)
      .set("boundary_ms", times.boundary)
      .set("iterate_ms", times.iterate)
      .set("download_ms", times.download)
      .set("wall_ms", times.wall);
  return json;
}

Json to_json(const SerialFigures& figures) {
  Json json;
  json.set("neighbours_ms", figures.neighbours_ms)
      .set("boundary_ms", figures.boundary_ms)
      .set("form_a_ms", figures.form_a_ms)
      .set("form_b_ms", figures.form_b_ms)
      .set("form_a_sweeps", figures.form_a_sweeps)
      .set("form_b_sweeps", figures.form_b_sweeps)
      .set("form_a_findings", to_json(figures.form_a))
      .set("form_b_findings", to_json(figures.form_b));
  return json;
}

Json to_json(const VariantFigures& figures, double tolerance, bool with_plain) {
  Json json;
  json.set("form", std::string(name_of(figures.variant.form)))
      .set("layout", std::string(name_of(figures.variant.layout)))
      .set("blocks", figures.many_blocks() ? "many" : "single")
      .set("block_count", figures.variant.block_count)
      .set("pooled", to_json(figures.pooled));
  if (with_plain) json.set("plain", to_json(figures.plain));
  Json counts;
  for (const BlockCountFigures& count : figures.block_counts) {
    Json entry;
    entry.set("block_count", count.block_count).set("iterate_ms", count.iterate_ms);
    counts.push(std::move(entry));
  }
  json.set("least_sweeps", figures.least_sweeps)
      .set("most_sweeps", figures.most_sweeps)
      .set("converged", figures.converged)
      .set("worst_findings", to_json(figures.worst))
      .set("within_tolerance", figures.worst.largest_move <= tolerance)
      .set("same_bits", figures.same_bits)
      .set("by_block_count", std::move(counts));
  return json;
}

}  // namespace

const VariantFigures& GpuFigures::best() const {
  return *std::min_element(variants.begin(), variants.end(),
                           [](const VariantFigures& a, const VariantFigures& b) {
                             return a.pooled.wall < b.pooled.wall;
                           });
}

Findings evaluate(const BenchMesh& mesh, const HostTopology& host,
                  const std::vector<Vec3f>& positions) {
  const ElementBlockView block = {ElementType::tetrahedron, mesh.tetrahedra};
  const TopologyView topology = {mesh.node_count(), {&block, 1}, {}};
  const PositionsView view = std::span<const Vec3f>(positions);
  const SurfaceOrientation orientation(topology, view);
  return {largest_move(host.rings, host.boundary, positions),
          measure_quality(topology, view, orientation).inverted_count};
}

PaperFigures measure_paper(const BenchMesh& mesh, const PaperSettings& settings,
                           HostTopology& host) {
  PaperFigures figures;
  SerialResult form_a;
  figures.serial = measure_serial(mesh, settings, host, form_a);
  figures.mesh = mesh.name;
  figures.node_count = mesh.node_count();
  figures.tetrahedron_count = mesh.tetrahedron_count();
  figures.entry_count = host.rings.entries.size();
  figures.boundary_count = static_cast<std::size_t>(
      std::count(host.boundary.begin(), host.boundary.end(), std::uint8_t{1}));
  figures.tolerance = settings.tolerance;
  figures.before = evaluate(mesh, host, mesh.float_positions());
  if (settings.with_gpu) {
    figures.gpu = GpuMeasurement(mesh, settings, host, form_a, figures.errors).measure();
  }
  return figures;
}

Json to_json(const PaperFigures& figures) {
  Json json;
  json.set("mesh", figures.mesh)
      .set("nodes", figures.node_count)
      .set("tetrahedra", figures.tetrahedron_count)
      .set("ring_entries", figures.entry_count)
      .set("boundary_nodes", figures.boundary_count)
      .set("tolerance", figures.tolerance)
      .set("before", to_json(figures.before))
      .set("serial", to_json(figures.serial));
  if (figures.gpu.variants.empty()) return json;
  Json variants;
  for (const VariantFigures& variant : figures.gpu.variants) {
    variants.push(to_json(variant, figures.tolerance, variant.plain.wall > 0));
  }
  Json gpu;
  gpu.set("neighbours_and_boundary_peak_bytes", figures.gpu.peak_bytes)
      .set("variants", std::move(variants));
  json.set("gpu", std::move(gpu));
  return json;
}

}  // namespace meshsmooth::bench
