// The steps of the pipeline on one mesh, per number of threads:
//   core_bench MESH [Google Benchmark flags]
// tests/bench/against_scipy.py runs it beside SciPy.

#include <benchmark/benchmark.h>

#include <cstdio>
#include <string>

#include "formats/mesh_file.hpp"
#include "smooth/cpu/cpu_backend.hpp"

namespace {

using namespace meshsmooth;
using namespace meshsmooth::detail;

/// Everything up to the first sweep, in the arrays that the pipeline uses.
struct Prepared {
  Renumbering renumbering;
  JobElements<CpuExecutor> elements;
  RowBuffer<CpuExecutor, ElementId> balls;
  RowBuffer<CpuExecutor, NodeId> rings;
  CpuBuffer<Vec3d> ordered;
  CpuBuffer<std::uint8_t> fixed;
  Box box;

  Prepared(CpuExecutor& executor, const TopologyView& topology, std::span<const Vec3d> positions)
      : ordered(executor.allocate<Vec3d>(positions.size())),
        fixed(executor.allocate<std::uint8_t>(positions.size())) {
    const std::size_t node_count = positions.size();
    box = find_box(executor, positions.data(), node_count);
    renumbering = renumber_nodes(executor, positions.data(), node_count, box);
    const NodeId* const caller_ids = renumbering.caller_ids.data();
    executor.for_each(node_count,
                      [&](std::size_t n) { ordered.data()[n] = positions[caller_ids[n]]; });
    elements = renumber_elements(executor, topology, renumbering.internal_of.data());
    balls = find_balls(executor, node_count, elements.view, elements.caller_ids.data());
    rings = find_rings(executor, node_count, elements.view, balls.view(), caller_ids);
    if (!find_boundary(executor, node_count, elements.view, balls.view(), fixed.data())) {
      throw_overused_facet(topology);
    }
  }

  [[nodiscard]] Surroundings around() const {
    return {ordered.size(), elements.view, rings.view(), balls.view(), fixed.data(), nullptr, {}};
  }
};

/// One mesh, one arena of `threads`.
struct Bench {
  explicit Bench(int threads) : arena(threads), executor(arena, interrupt) {}
  JobControl control;
  Interrupt interrupt{control};
  tbb::task_arena arena;
  CpuExecutor executor;
};

const Mesh* mesh = nullptr;

const std::vector<Vec3d>& positions() { return std::get<std::vector<Vec3d>>(mesh->positions); }

void find_neighbours_and_boundary(benchmark::State& state) {
  Bench bench(static_cast<int>(state.range(0)));
  const MeshTopology topology(*mesh);
  for (auto _ : state) {
    const Prepared prepared(bench.executor, topology.view(), positions());
    benchmark::DoNotOptimize(prepared.rings.entries.data());
  }
  state.counters["nodes"] = static_cast<double>(mesh->node_count());
  state.counters["elements"] = static_cast<double>(mesh->element_count());
}

template <class Body>
void sweep(benchmark::State& state, const Body& body) {
  Bench bench(static_cast<int>(state.range(0)));
  const MeshTopology topology(*mesh);
  Prepared prepared(bench.executor, topology.view(), positions());
  body(bench.executor, prepared);
  state.counters["nodes/s"] = benchmark::Counter(static_cast<double>(mesh->node_count()),
                                                 benchmark::Counter::kIsIterationInvariantRate);
}

void uniform_jacobi_sweep(benchmark::State& state) {
  sweep(state, [&](CpuExecutor& executor, Prepared& prepared) {
    auto other = executor.allocate<Vec3d>(prepared.ordered.size());
    Vec3d* before = prepared.ordered.data();
    Vec3d* after = other.data();
    std::copy(before, before + prepared.ordered.size(), after);
    for (auto _ : state) {
      benchmark::DoNotOptimize(
          sweep_jacobi(executor, SweepContext<CpuExecutor, double>{prepared.around()},
                       LaplacianStep<UniformMean, double>{{}, 1.0}, before, after));
      std::swap(before, after);
    }
  });
}

void smart_gauss_seidel_sweep(benchmark::State& state) {
  sweep(state, [&](CpuExecutor& executor, Prepared& prepared) {
    const auto colouring =
        colour_nodes(executor, prepared.around(), prepared.renumbering.caller_ids.data());
    const SweepContext<CpuExecutor, double> context{
        prepared.around(), &colouring, {.guard = true, .smart = true}};
    for (auto _ : state) {
      benchmark::DoNotOptimize(
          sweep_gauss_seidel(executor, context, UniformMean{}, 1.0, prepared.ordered.data()));
    }
  });
}

void colour(benchmark::State& state) {
  sweep(state, [&](CpuExecutor& executor, Prepared& prepared) {
    for (auto _ : state) {
      const auto colouring =
          colour_nodes(executor, prepared.around(), prepared.renumbering.caller_ids.data());
      state.counters["colours"] = static_cast<double>(colouring.count());
    }
  });
}

void evaluate(benchmark::State& state) {
  tbb::task_arena arena(static_cast<int>(state.range(0)));
  const MeshTopology topology(*mesh);
  arena.execute([&] {
    const SurfaceOrientation orientation(topology.view(), mesh->positions_view());
    for (auto _ : state) {
      benchmark::DoNotOptimize(
          measure_quality(topology.view(), mesh->positions_view(), orientation));
    }
  });
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (argc != 2) {
    std::fprintf(stderr, "usage: core_bench MESH [benchmark flags]\n");
    return 2;
  }
  const auto file = meshsmooth::formats::read_mesh_file(argv[1]);
  mesh = &file.mesh;
  for (auto* registered : {
           benchmark::RegisterBenchmark("find_neighbours_and_boundary",
                                        find_neighbours_and_boundary),
           benchmark::RegisterBenchmark("uniform_jacobi_sweep", uniform_jacobi_sweep),
           benchmark::RegisterBenchmark("smart_gauss_seidel_sweep", smart_gauss_seidel_sweep),
           benchmark::RegisterBenchmark("colour", colour),
           benchmark::RegisterBenchmark("evaluate", evaluate),
       }) {
    registered->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
