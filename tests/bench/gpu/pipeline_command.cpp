#include <CLI/App.hpp>
#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>

#include "gpu/commands.hpp"
#include "gpu/pipeline_report.hpp"

namespace meshsmooth::bench {
namespace {

constexpr float kTolerance = 1e-4F;
constexpr double kAgreement = 1e-5;  // of positions in the unit cube
constexpr double kQualityAgreement = 1e-6;
constexpr std::size_t kMethodsNodes = 100'000;
constexpr int kMethodSweeps = 20;
constexpr int kGridSide = 215;
constexpr int kHugeSide = 257;

struct PipelineCommand {
  std::vector<std::size_t> node_counts = {5000, 100'000, 1'000'000};
  bool grid = false;
  bool huge = false;
  bool lanes = false;
  int repeats = 15;
  std::filesystem::path json;
  std::filesystem::path cache;
};

/// Bytes that a sweep cannot do without: the ids of the rings of the nodes that
/// move, an offset per node, all positions read and those that move written.
double compulsory_bytes(const HostTopology& topology, std::size_t real_bytes) {
  std::size_t moving = 0, ids = 0;
  for (std::size_t node = 0; node < topology.boundary.size(); ++node) {
    if (topology.boundary[node] != 0) continue;
    ++moving;
    ids += topology.rings.of(node).size();
  }
  const std::size_t nodes = topology.boundary.size();
  return static_cast<double>(4 * ids + 4 * nodes + 3 * real_bytes * (nodes + moving));
}

class PipelineRun {
 public:
  explicit PipelineRun(const PipelineCommand& command) : command_(command) {}

  int run() {
    report_.device = find_device();
    report_.repeats = command_.repeats;
    report_.method_sweeps = kMethodSweeps;
    if (report_.device.name.empty()) {
      std::cerr << "meshsmooth-bench: there is no CUDA device or driver\n";
      return 1;
    }
    std::cout << "device: " << report_.device.name << ", " << report_.device.multiprocessor_count
              << " multiprocessors" << std::endl;
    attempt("copy bandwidth", [&] { report_.copy_bandwidth = measure_copy_bandwidth(); });
    for (const std::size_t count : command_.node_counts) {
      attempt("cube " + short_count(count), [&] { measure_cube(count); });
    }
    if (command_.lanes) attempt("lanes", [&] { run_lanes(); });
    if (command_.grid) {
      for (const NodeOrder order : {NodeOrder::natural, NodeOrder::permuted}) {
        attempt("grid", [&] { measure_grid(make_grid(kGridSide, order)); });
      }
    }
    if (command_.huge) attempt("huge", [&] { measure_huge(); });
    print(std::cout, report_);
    for (const std::string& error : report_.errors) std::cerr << "FAILED " << error << '\n';
    return report_.errors.empty() ? 0 : 1;
  }

 private:
  /// What fails is told, counts, and leaves the rest its turn.
  void attempt(const std::string& what, const std::function<void()>& body) {
    std::cerr << "measuring " << what << std::endl;
    try {
      body();
    } catch (const std::exception& error) {
      fail(what + ": " + error.what());
    }
    write_json(command_.json, to_json(report_));
  }

  void fail(const std::string& message) {
    std::cerr << "FAILED " << message << std::endl;
    report_.errors.push_back(message);
  }

  void need_agreement(const std::string& what, double difference) {
    if (difference <= kAgreement) return;  // false for a NaN
    std::ostringstream text;
    text << what << " differs from the serial algorithm by " << difference;
    fail(text.str());
  }

  void measure_cube(std::size_t node_count) {
    const BenchMesh mesh = make_cube(node_count, command_.cache);
    MeshFigures figures;
    HostTopology host;
    attempt(mesh.name + " paper", [&] {
      PaperSettings settings;
      settings.repeats = std::min(command_.repeats, 5);
      settings.with_plain_memory = false;
      figures.paper = measure_paper(mesh, settings, host);
      for (const std::string& error : figures.paper->errors) fail(error);
    });
    attempt(mesh.name + " optimize", [&] {
      figures.optimize = measure_optimize(mesh, std::min(command_.repeats, 7));
      if (!(figures.optimize->cpu_difference <= kQualityAgreement)) {
        fail(mesh.name + ": the backends' quality after optimize differs by " +
             number(*figures.optimize->cpu_difference));
      }
    });
    measure_mesh(mesh, host, figures);
    if (node_count == kMethodsNodes) attempt(mesh.name + " methods", [&] { run_methods(mesh); });
  }

  void measure_grid(const BenchMesh& mesh) {
    MeshFigures figures;
    HostTopology host;
    attempt(mesh.name + " paper", [&] {
      const Stream stream;
      PaperSystem system(mesh, kTolerance, stream);
      DeviceHeap heap(Memory::pooled, stream);
      StageMilliseconds times;
      static_cast<void>(system.make_topology(heap, times));  // warm-up: fills the pool
      heap.restart_peak();
      const DeviceTopology topology = system.make_topology(heap, times);
      figures.paper_topology = times;
      figures.paper_peak_bytes = heap.peak_bytes();
      host = download_topology(topology, stream);
    });
    measure_mesh(mesh, host, figures);
  }

  void measure_mesh(const BenchMesh& mesh, const HostTopology& host, MeshFigures& figures) {
    figures.mesh = mesh.name;
    figures.node_count = mesh.node_count();
    figures.tetrahedron_count = mesh.tetrahedron_count();
    if (host.boundary.empty()) throw std::runtime_error("there is nothing to compare with");
    figures.sweep_bytes = compulsory_bytes(host, sizeof(float));
    figures.sweep_double_bytes = compulsory_bytes(host, sizeof(double));
    const std::vector<Vec3f> input = mesh.float_positions();
    const std::vector<Vec3f> expected =
        smooth_form_a(host.rings, host.boundary, input, 0, kCheckedSweeps).positions;
    {
      const PinnedTopology topology(mesh);
      attempt(mesh.name + " product", [&] {
        const auto smoother = make_smoother("cuda");
        measure_precision<float>(*smoother, mesh, topology, host, expected, figures.product,
                                 figures.sweep_us);
        measure_precision<double>(*smoother, mesh, topology, host, expected, figures.product_double,
                                  figures.sweep_double_us);
      });
      attempt(mesh.name + " CPU backend", [&] {
        const auto smoother = make_smoother("cpu");
        PinnedPositions<float> positions(mesh);
        const int repeats = std::min(command_.repeats, 3);
        figures.cpu =
            measure_product(*smoother, topology, positions, plain_options(kTolerance), repeats);
        if (mesh.node_count() <= 1'000'000) {
          figures.cpu_sweep_us = sweep_microseconds(*smoother, topology, positions, repeats);
        }
      });
    }
    const PeerInput peer_input = {host, input, expected, std::min(command_.repeats, 7)};
    attempt(mesh.name + " cuSPARSE", [&] { figures.cusparse = measure_cusparse(peer_input); });
    attempt(mesh.name + " scatter-add", [&] { figures.scatter = measure_scatter_add(peer_input); });
    for (const PeerSweep& peer : figures.cusparse) {
      if (peer.skipped.empty())
        need_agreement(mesh.name + " " + peer.name, peer.largest_difference);
    }
    if (figures.scatter) {
      need_agreement(mesh.name + " scatter-add", figures.scatter->largest_difference);
    }
    report_.meshes.push_back(std::move(figures));
  }

  template <class Real>
  void measure_precision(Smoother& smoother, const BenchMesh& mesh, const PinnedTopology& topology,
                         const HostTopology& host, const std::vector<Vec3f>& expected,
                         std::optional<ProductFigures>& figures, std::optional<double>& sweep) {
    const std::string name =
        mesh.name + (sizeof(Real) == sizeof(float) ? " product float32" : " product float64");
    PinnedPositions<Real> positions(mesh);
    static_cast<void>(
        smoother.smooth(topology.view(), positions.span(), plain_options(0, kCheckedSweeps), {}));
    need_agreement(name + " after two sweeps", largest_difference(positions.as_float(), expected));
    figures =
        measure_product(smoother, topology, positions, plain_options(kTolerance), command_.repeats);
    if (mesh.node_count() <= 1'000'000) {
      const int sweeps = figures->summary.convergence.iteration_count;
      const SerialResult serial =
          smooth_form_a(host.rings, host.boundary, mesh.float_positions(), 0, sweeps);
      need_agreement(name, largest_difference(positions.as_float(), serial.positions));
    }
    sweep = sweep_microseconds(smoother, topology, positions, std::min(command_.repeats, 7));
  }

  void run_methods(const BenchMesh& mesh) {
    const auto smoother = make_smoother("cuda");
    const PinnedTopology topology(mesh);
    PinnedPositions<float> positions(mesh);
    const auto measure = [&](const std::string& name, const Method& method, Form form, bool guard) {
      SmoothOptions options = plain_options(0, kMethodSweeps);
      options.method = method;
      options.form = form;
      options.guard = guard;
      report_.methods.push_back({name, {}});
      attempt("method " + name, [&] {
        report_.methods.back().figures =
            measure_product(*smoother, topology, positions, options, command_.repeats);
      });
    };
    constexpr std::pair<Weighting, const char*> kWeightings[] = {
        {Weighting::uniform, "uniform"},
        {Weighting::inverse_edge_length, "inverse edge length"},
        {Weighting::edge_length, "edge length"},
        {Weighting::ball_volume, "ball volume"}};
    for (const auto& [weighting, name] : kWeightings) {
      measure(std::string("laplacian ") + name, Laplacian{weighting, 1.0}, Form::automatic, true);
      measure(std::string("smart laplacian ") + name, SmartLaplacian{weighting, 1.0},
              Form::automatic, true);
    }
    measure("laplacian uniform, no guard", Laplacian{}, Form::automatic, false);
    measure("smart laplacian uniform, jacobi", SmartLaplacian{}, Form::jacobi, true);
    measure("taubin", Taubin{}, Form::automatic, true);
    measure("hc laplacian", HcLaplacian{}, Form::automatic, true);
  }

  void run_lanes() {
    report_.lanes = measure_lanes(make_cube(5000, command_.cache), kTolerance, {1, 2, 4, 8});
    for (const LaneFigures& figures : report_.lanes) {
      if (figures.different_count == 0) continue;
      fail(std::to_string(figures.different_count) + " results of " +
           std::to_string(figures.lane_count) + " lanes differ from the single lane's");
    }
  }

  void measure_huge() {
    const BenchMesh mesh = make_grid(kHugeSide, NodeOrder::natural);
    const PinnedTopology topology(mesh);
    PinnedPositions<float> positions(mesh);
    const auto smoother = make_smoother("cuda");
    MeshFigures figures;
    figures.mesh = mesh.name;
    figures.node_count = mesh.node_count();
    figures.tetrahedron_count = mesh.tetrahedron_count();
    figures.product = measure_product(*smoother, topology, positions, plain_options(kTolerance), 3);
    report_.meshes.push_back(std::move(figures));
  }

  const PipelineCommand& command_;
  PipelineReport report_;
};

}  // namespace

void add_pipeline_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<PipelineCommand>();
  CLI::App* sub = app.add_subcommand("pipeline", "The product beside its peers on the same meshes");
  sub->add_option("--nodes", command->node_counts, "Cubes by number of nodes")
      ->delimiter(',')
      ->check(CLI::Range(std::size_t{27}, std::size_t{100'000'000}))
      ->capture_default_str();
  sub->add_flag("--grid10m", command->grid,
                "Also a jittered grid of 10 million nodes, ids natural and permuted");
  sub->add_flag("--huge", command->huge, "Also a grid of 100 million tetrahedra in one job");
  sub->add_flag("--lanes", command->lanes, "Also jobs per second with 1, 2, 4 and 8 lanes");
  sub->add_option("--repeat", command->repeats, "Timed runs")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  sub->add_option("--json", command->json, "Writes everything measured here");
  sub->add_option("--cache", command->cache, "Keeps the meshes in this directory");
  sub->callback([&action, command] { action = [command] { return PipelineRun(*command).run(); }; });
}

}  // namespace meshsmooth::bench
