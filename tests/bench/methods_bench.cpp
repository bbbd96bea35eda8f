// The methods of the CPU backend on one mesh, 20 sweeps at most but for optimize:
//   methods_bench MESH [THREADS] [REPETITIONS] [METHOD]
// The least of several runs; METHOD selects by a part of its name.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <string>
#include <string_view>

#include "formats/mesh_file.hpp"
#include "meshsmooth/smoother.hpp"

namespace {

using namespace meshsmooth;
using Clock = std::chrono::steady_clock;

struct Task {
  const char* name;
  Method method;
  int most_sweeps = 20;
  bool guard = true;
};

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void run(Smoother& smoother, const Mesh& mesh, const Task& task, int repetitions) {
  double iterate = HUGE_VAL, evaluate = HUGE_VAL, wall = HUGE_VAL, processor = HUGE_VAL;
  SmoothSummary summary;
  for (int repeat = 0; repeat < repetitions; ++repeat) {
    Mesh copy = mesh;
    const double processor_start = processor_seconds();
    const Clock::time_point start = Clock::now();
    summary = smoother.smooth(copy, {.method = task.method,
                                     .max_iterations = task.most_sweeps,
                                     .guard = task.guard,
                                     .never_worse = false});
    wall = std::min(wall, std::chrono::duration<double>(Clock::now() - start).count());
    processor = std::min(processor, processor_seconds() - processor_start);
    iterate = std::min(iterate, summary.times.iterate_seconds);
    evaluate = std::min(evaluate, summary.times.evaluate_seconds);
  }
  std::printf("%-22s %3d sweeps, s: iterate %.4f, evaluate %.4f, wall %.4f, processors %.4f\n",
              task.name, summary.convergence.iteration_count, iterate, evaluate, wall, processor);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 5) {
    std::fprintf(stderr, "usage: methods_bench MESH [THREADS] [REPETITIONS] [METHOD]\n");
    return 2;
  }
  try {
    const Mesh mesh = formats::read_mesh_file(argv[1]).mesh;
    const auto smoother = make_smoother("cpu", argc > 2 ? std::atoi(argv[2]) : 0);
    const int repetitions = argc > 3 ? std::atoi(argv[3]) : 3;
    const std::string_view part = argc > 4 ? argv[4] : "";
    const Task tasks[] = {
        {"evaluate", Optimize{}, 0},    {"smart-laplacian", SmartLaplacian{}},
        {"laplacian", Laplacian{}},     {"laplacian, no guard", Laplacian{}, 20, false},
        {"taubin", Taubin{}},           {"hc-laplacian", HcLaplacian{}},
        {"optimize", Optimize{}, 1000}, {"optimize, goal worst", Optimize{Goal::worst}, 1000}};
    for (const Task& task : tasks) {
      if (std::string_view(task.name).find(part) != std::string_view::npos) {
        run(*smoother, mesh, task, repetitions);
      }
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "methods_bench: %s\n", error.what());
    return 1;
  }
}
