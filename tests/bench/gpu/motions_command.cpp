#include <CLI/App.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <iostream>
#include <memory>
#include <numbers>
#include <stop_token>
#include <thread>

#include "gpu/commands.hpp"
#include "gpu/laplace_values.hpp"
#include "gpu/product.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/staging_memory.hpp"

namespace meshsmooth::bench {
namespace {

/// A mesh whose whole boundary moves by a map, times a share.
struct Case {
  std::string name;
  BenchMesh mesh;
  std::function<Vec3d(Vec3d, double)> map;
  double step;  // the share that is a small one
};

Vec3d turned(Vec3d p, Vec3d about, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  const Vec3d q = p - about;
  return about + Vec3d{q.x * std::cos(angle) - q.y * std::sin(angle),
                       q.x * std::sin(angle) + q.y * std::cos(angle), q.z};
}

/// An annulus of radii 0.4 and 1, extruded: `rows` x 4 `rows` x `rows` cells of six tetrahedra.
BenchMesh make_hub(int rows) {
  const int around = 4 * rows;
  const auto node = [=](int i, int j, int k) {
    return static_cast<NodeId>((i * around + j % around) * (rows + 1) + k);
  };
  BenchMesh mesh;
  for (int i = 0; i <= rows; ++i) {
    for (int j = 0; j < around; ++j) {
      for (int k = 0; k <= rows; ++k) {
        const Vec3d p{0.4 + 0.6 * i / rows, 0, 0.6 * k / rows};
        mesh.positions.push_back(turned(p, {}, 360.0 * j / around));
        if (i == rows || k == rows) continue;
        // Along the edges of the cell in each order of the axes, every other one turned round.
        const NodeId first = node(i, j, k), last = node(i + 1, j + 1, k + 1);
        const NodeId ring[] = {node(i + 1, j, k),     node(i + 1, j + 1, k), node(i, j + 1, k),
                               node(i, j + 1, k + 1), node(i, j, k + 1),     node(i + 1, j, k + 1)};
        for (int n = 0; n < 6; ++n) {
          mesh.tetrahedra.insert(mesh.tetrahedra.end(), {first, ring[n], ring[(n + 1) % 6], last});
        }
      }
    }
  }
  return mesh;
}

Case hub(int rows, double degrees) {
  return {"hub by " + std::to_string(static_cast<int>(degrees)) + " degrees", make_hub(rows),
          [=](Vec3d p, double share) {
            return turned(p, {}, share * degrees * (1 - std::hypot(p.x, p.y)) / 0.6);
          },
          0.5 / degrees};
}

Case twisted(std::string name, BenchMesh mesh) {
  return {std::move(name), std::move(mesh),
          [](Vec3d p, double share) {
            return turned(p, {0.5, 0.5, 0}, share * 90 * p.z);
          },
          0.5 / 90};
}

/// A jittered grid whose layers grow in geometric progression; the first one is `aspect` times as
/// wide as high.
Case layer(int side, double aspect) {
  BenchMesh mesh = make_grid(side, NodeOrder::natural);
  // Heights (q^n - 1) / (q^cells - 1) of n layers: the first one is 1 / (cells aspect).
  const double cells = side - 1;
  double low = 1, high = 2;
  for (int n = 0; n < 100; ++n) {
    const double growth = (low + high) / 2;
    const bool thin = (growth - 1) / (std::pow(growth, cells) - 1) * cells * aspect < 1;
    (thin ? high : low) = growth;
  }
  for (Vec3d& p : mesh.positions) {
    p.z = (std::pow(low, cells * p.z) - 1) / (std::pow(low, cells) - 1);
  }
  return {"layer, aspect ratio " + std::to_string(static_cast<int>(aspect)), std::move(mesh),
          [](Vec3d p, double share) {
            return p + Vec3d{0, 0, share * 0.1 * std::sin(std::numbers::pi * p.x)};
          },
          0.01};
}

/// In page-locked memory where there is a device, as the server has them.
struct Motion {
  std::unique_ptr<StagingMemory> locked;  // null: there is no device
  std::pmr::memory_resource* memory = locked ? locked.get() : std::pmr::new_delete_resource();
  std::pmr::vector<NodeId> tetrahedra;
  std::pmr::vector<Vec3d> reference, result;
  ElementBlockView block;
  std::vector<NodeId> nodes;
  std::vector<Vec3d> to;

  Motion(std::string_view backend, const Case& of, double share)
      : locked(make_staging_memory(backend, std::size_t{1} << 32)),
        tetrahedra(of.mesh.tetrahedra.begin(), of.mesh.tetrahedra.end(), memory),
        reference(of.mesh.positions.begin(), of.mesh.positions.end(), memory),
        result(reference, memory),
        block{ElementType::tetrahedron, tetrahedra},
        nodes(find_boundary_nodes(topology())) {
    place(of, share);
  }
  [[nodiscard]] TopologyView topology() const { return {reference.size(), {&block, 1}, {}}; }
  void place(const Case& of, double share) {
    to.clear();
    for (const NodeId node : nodes) {
      to.push_back(of.map(of.mesh.positions[static_cast<std::size_t>(node)], share));
    }
  }
  [[nodiscard]] std::span<const Vec3d> given() const { return reference; }
  [[nodiscard]] SmoothOptions options() const {
    SmoothOptions options;
    options.method = Move{};
    options.quality_detail = QualityDetail::brief;
    return options;
  }
  [[nodiscard]] JobPositions arrays() {
    JobPositions arrays(given(), std::span<Vec3d>(result));
    arrays.input.prescribed = {nodes, std::span<const Vec3d>(to)};
    return arrays;
  }
};

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

class Figures {
 public:
  Figures(const Case& of, Table& table, Json& rows) : of_(of), table_(table), rows_(rows) {}

  /// Runs a job some times, after what `before` does; medians.
  template <class Run>
  void add(
      const std::string& task, int repeats, const Run& run,
      const std::function<void()>& before = [] {}) {
    std::vector<double> wall, linear, iterate, evaluate;
    SmoothSummary summary;
    for (int n = 0; n < repeats; ++n) {
      before();
      const auto begin = std::chrono::steady_clock::now();
      summary = run();
      wall.push_back(milliseconds_since(begin));
      linear.push_back(1e3 * summary.motion->linear_seconds);
      iterate.push_back(1e3 * summary.times.iterate_seconds);
      evaluate.push_back(1e3 * summary.times.evaluate_seconds);
    }
    const MotionStats& motion = *summary.motion;
    const std::string nodes = short_count(of_.mesh.node_count());
    table_.add({of_.name, nodes, task, number(median(wall)), number(median(linear)),
                std::to_string(motion.linear_iteration_count), number(median(iterate)),
                number(median(evaluate)), std::to_string(summary.convergence.iteration_count),
                number(motion.reached), std::to_string(summary.quality_after.inverted_count)});
    Json row;
    row.set("case", of_.name)
        .set("nodes", of_.mesh.node_count())
        .set("task", task)
        .set("wall_ms", median(wall))
        .set("linear_ms", median(linear))
        .set("linear_iterations", motion.linear_iteration_count)
        .set("iterate_ms", median(iterate))
        .set("evaluate_ms", median(evaluate))
        .set("sweeps", summary.convergence.iteration_count)
        .set("reached", motion.reached)
        .set("inverted", summary.quality_after.inverted_count);
    rows_.push(std::move(row));
  }

  /// A time that is no job's.
  void add_time(const std::string& task, double milliseconds) {
    table_.add({of_.name, short_count(of_.mesh.node_count()), task, number(milliseconds), "", "",
                "", "", "", "", ""});
    Json row;
    row.set("case", of_.name).set("nodes", of_.mesh.node_count());
    rows_.push(std::move(row.set("task", task).set("wall_ms", milliseconds)));
  }

 private:
  const Case& of_;
  Table& table_;
  Json& rows_;
};

/// The longest time in which a job ends that is cancelled at several places on its way.
double longest_cancel_ms(const std::function<void(const JobControl&)>& job) {
  const auto whole = std::chrono::steady_clock::now();
  job({});
  const double duration = milliseconds_since(whole);
  constexpr int kPlaces = 12;
  double longest = 0;
  for (int place = 0; place < kPlaces; ++place) {
    std::stop_source stop;
    JobControl control;
    control.stop = stop.get_token();
    std::chrono::steady_clock::time_point ended;
    std::thread running([&] {
      try {
        job(control);
      } catch (const Cancelled&) {
      }
      ended = std::chrono::steady_clock::now();
    });
    std::this_thread::sleep_for(
        std::chrono::duration<double, std::milli>(duration * (place + 0.5) / kPlaces));
    const auto asked = std::chrono::steady_clock::now();
    stop.request_stop();
    running.join();
    const std::chrono::duration<double, std::milli> took = ended - asked;
    longest = std::max(longest, took.count());
  }
  return longest;
}

void measure(Smoother& smoother, const Case& of, int repeats, Table& table, Json& rows) {
  Figures figures(of, table, rows);
  if (smoother.backend() != "cpu") {
    figures.add_time("values of another reference", laplace_values_ms(of.mesh, repeats));
  }
  Motion motion(smoother.backend(), of, 1);
  figures.add("whole", repeats, [&] {
    return smoother.smooth(motion.topology(), motion.arrays(), motion.options(), {});
  });
  const auto prepared = smoother.prepare(motion.topology(), {}, motion.given());
  const auto run = [&] {
    return smoother.smooth(*prepared, motion.arrays(), motion.options(), {});
  };
  figures.add("first on a kept reference", 1, run);
  figures.add("kept", repeats, run);
  figures.add_time(
      "kept, cancelled: the longest wait", longest_cancel_ms([&](const JobControl& control) {
        static_cast<void>(smoother.smooth(*prepared, motion.arrays(), motion.options(), control));
      }));
  motion.place(of, of.step);
  figures.add("kept, small step", repeats, run);
  double share = 1;
  const auto step = [&] { motion.place(of, share += of.step); };
  const auto run_warm = [&] {
    SmoothOptions options = motion.options();
    options.method = Move{.start = Start::warm};
    return smoother.smooth(*prepared, motion.arrays(), options, {});
  };
  for (int n = 0; n < 2; ++n) {  // to extrapolate from
    step();
    (void)run_warm();
  }
  figures.add("kept, warm steps", repeats, run_warm, step);
}

int run(const std::string& backend, std::size_t most, const std::filesystem::path& cache,
        const std::filesystem::path& json_file) {
  const auto smoother = make_smoother(backend);
  Table table({"case", "nodes", "task", "wall ms", "linear ms", "iterations", "iterate", "evaluate",
               "sweeps", "reached", "inverted"});
  Json rows;
  struct Size {
    std::size_t nodes;
    int rows, side;
  };
  for (const auto& [nodes, hub_rows, side] : {Size{10'000, 13, 21}, Size{100'000, 28, 46},
                                              Size{1'000'000, 62, 99}, Size{10'000'000, 135, 0}}) {
    if (nodes > most) break;
    const int repeats = nodes > 500'000 ? 3 : 7;
    measure(*smoother, hub(hub_rows, 30), repeats, table, rows);
    if (side == 0) continue;
    measure(*smoother, twisted("Delaunay cube twisted by 90 degrees", make_cube(nodes, cache)),
            repeats, table, rows);
    measure(*smoother, layer(side, 1000), repeats, table, rows);
  }
  std::cout << "Motions of a boundary, float64; medians\n";
  table.print(std::cout);
  Json json;
  json.set("backend", std::string(smoother->backend())).set("rows", std::move(rows));
  write_json(json_file, json);
  return 0;
}

}  // namespace

void add_motions_command(CLI::App& app, Action& action) {
  struct Options {
    std::string backend = "cuda:0";
    std::size_t most = 1'000'000;
    std::filesystem::path cache, json;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* const command =
      app.add_subcommand("motions", "moved boundaries, with a kept reference");
  command->add_option("--backend", options->backend, "backend")->capture_default_str();
  command->add_option("--most", options->most, "nodes of the largest meshes")
      ->capture_default_str();
  command->add_option("--cache", options->cache, "folder where meshes are kept");
  command->add_option("--json", options->json, "file for the figures");
  command->callback([&action, options] {
    action = [options] {
      return run(options->backend, options->most, options->cache, options->json);
    };
  });
}

}  // namespace meshsmooth::bench
