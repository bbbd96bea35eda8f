// Callers of a fleet: moving meshes whose steps go out over sessions, some at a time. Every step
// is first asked of one worker alone; the fleet's answer must be the same to the last bit.
//   fleet_load --reference HOST:PORT --server TARGET --jobs N …
// Writes "answer N" after each; the exit code is 1 when one was lost or differs.

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <iostream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "meshsmooth/client.hpp"
#include "support/meshes.hpp"

namespace meshsmooth {
namespace {

struct Settings {
  std::string reference, server;
  int job_count = 200;
  int mesh_count = 20;
  int caller_count = 8;
  int cells = 12;  // along an edge of the cube
};

using Positions = std::vector<Vec3d>;

/// The positions of a mesh at one of its steps.
Positions step_of(const Mesh& mesh, int step) {
  return test::points(test::noisy(mesh, 0.15, static_cast<unsigned>(step)));
}

SmoothOptions options() {
  SmoothOptions options;
  options.method = SmartLaplacian{};
  options.max_iterations = 50;
  return options;
}

class Load {
 public:
  explicit Load(const Settings& settings)
      : settings_(settings), expected_(static_cast<std::size_t>(settings.job_count)) {
    for (int m = 0; m < settings.mesh_count; ++m) {
      // Names of topologies are made of content: each has one more node that stays.
      Mesh mesh = test::lattice(ElementType::tetrahedron, settings.cells);
      mesh.fixed.assign(mesh.node_count(), 0);
      mesh.fixed[static_cast<std::size_t>(m) % mesh.node_count()] = 1;
      mesh.fixed[mesh.node_count() / 2 + static_cast<std::size_t>(m)] = 1;
      meshes_.push_back(std::move(mesh));
    }
  }

  /// 0 when all is well.
  int run() {
    ask(settings_.reference, [this](int job, const Positions& answer, bool) {
      expected_[static_cast<std::size_t>(job)] = answer;
    });
    if (lost_ > 0) return 1;
    std::atomic<int> answers = 0, reused = 0, different = 0;
    const auto begin = std::chrono::steady_clock::now();
    ask(settings_.server, [&](int job, const Positions& answer, bool topology_reused) {
      if (answer != expected_[static_cast<std::size_t>(job)]) ++different;
      if (topology_reused) ++reused;
      const std::lock_guard lock(output_);
      std::cout << "answer " << ++answers << std::endl;
    });
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
    // The first step of a mesh cannot find its topology.
    const int repeated = settings_.job_count - settings_.mesh_count;
    std::cout << "jobs " << settings_.job_count << " answers " << answers << " lost " << lost_
              << " different " << different << " repeated " << repeated << " reused " << reused
              << " seconds " << elapsed.count() << std::endl;
    return lost_ == 0 && different == 0 ? 0 : 1;
  }

 private:
  /// All jobs; a caller has some of the meshes, and makes a step of each in turn.
  template <class Take>
  void ask(const std::string& address, const Take& take) {
    std::vector<std::jthread> callers;
    for (int c = 0; c < settings_.caller_count; ++c) {
      callers.emplace_back([this, address, take, c] {
        client::Client client(address);
        std::vector<client::Session> sessions;
        for (int m = c; m < settings_.mesh_count; m += settings_.caller_count) {
          sessions.push_back(client.open(mesh(m)));
        }
        for (int job = 0; job < settings_.job_count; ++job) {
          const int m = job % settings_.mesh_count;
          if (m % settings_.caller_count != c) continue;
          Positions positions = step_of(mesh(m), job);
          try {
            const auto report =
                sessions[static_cast<std::size_t>(m / settings_.caller_count)].smooth(positions,
                                                                                      options());
            take(job, positions, report.topology_reused);
          } catch (const client::ServiceError& error) {
            ++lost_;
            const std::lock_guard lock(output_);
            std::cout << "lost " << job << ": " << static_cast<int>(error.code()) << ' '
                      << error.reason() << ' ' << error.what() << std::endl;
          }
        }
      });
    }
  }
  [[nodiscard]] const Mesh& mesh(int m) const { return meshes_[static_cast<std::size_t>(m)]; }

  const Settings settings_;
  std::vector<Mesh> meshes_;
  std::vector<Positions> expected_;
  std::atomic<int> lost_ = 0;
  std::mutex output_;
};

}  // namespace
}  // namespace meshsmooth

int main(int argc, char** argv) {
  CLI::App app("Sends jobs to a fleet and compares its answers with one worker's.", "fleet_load");
  meshsmooth::Settings settings;
  app.add_option("--reference", settings.reference, "A worker alone")->required();
  app.add_option("--server", settings.server, "The fleet")->required();
  app.add_option("--jobs", settings.job_count, "In all")->capture_default_str();
  app.add_option("--meshes", settings.mesh_count, "That move")->capture_default_str();
  app.add_option("--callers", settings.caller_count, "At a time")->capture_default_str();
  app.add_option("--cells", settings.cells, "Along an edge of a mesh")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return meshsmooth::Load(settings).run();
}
