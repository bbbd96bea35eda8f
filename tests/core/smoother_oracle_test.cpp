// Sweeps compared with the slow and obvious version.

#include <gmock/gmock.h>

#include <atomic>

#include "core/smoothing.hpp"
#include "smooth/base/colouring_rule.hpp"

namespace meshsmooth {
namespace {

using test::difference;
using test::Job;
using test::sweeps;
using test::oracle::Points;
using test::oracle::Slow;
using test::oracle::to_points;

/// Valid meshes of every kind with free nodes, noisy.
std::vector<std::pair<std::string, Mesh>> noisy_meshes() {
  std::vector<std::pair<std::string, Mesh>> meshes;
  for (const ElementType type : kLinearTypes) {
    meshes.emplace_back(element_name(type), test::noisy(test::lattice(type, 5), 0.12, 11));
  }
  meshes.emplace_back("mixed", test::noisy(test::mixed_stack(4), 0.12, 12));
  meshes.emplace_back("ring", test::triangle_ring());
  meshes.emplace_back("ball", test::with_isolated_node(test::tet_ball()));
  meshes.emplace_back("sphere", test::noisy(test::sphere(3), 0.02, 13));
  Mesh masked = test::noisy(test::lattice(ElementType::tetrahedron, 5), 0.12, 14);
  for (std::size_t n = 0; n < masked.node_count(); ++n) masked.fixed.push_back(n % 3 == 0 ? 1 : 0);
  meshes.emplace_back("masked", masked);
  return meshes;
}

/// Smart averaging in Jacobi form has no formula node by node: moves are cut
/// back together; the optimizer goes down an energy; a filter has no sweeps. Their promises are
/// tested instead.
std::vector<test::Way> ways_with_formula() {
  std::vector<test::Way> ways = test::ways(false);
  std::erase_if(ways, [](const test::Way& way) {
    return std::holds_alternative<Optimize>(way.method) ||
           std::holds_alternative<WindowedSinc>(way.method) ||
           (std::holds_alternative<SmartLaplacian>(way.method) && way.form == Form::jacobi);
  });
  return ways;
}

class EveryMethod : public testing::TestWithParam<test::Way> {};
INSTANTIATE_TEST_SUITE_P(Sweep, EveryMethod, testing::ValuesIn(ways_with_formula()),
                         test::way_name);

TEST_P(EveryMethod, MovesNodesAsTheFormulaSays) {
  const auto& [way, method, form] = GetParam();
  const auto* const smart = std::get_if<SmartLaplacian>(&method);
  for (const auto& [name, mesh] : noisy_meshes()) {
    if (smart != nullptr && name == "sphere") continue;  // the oracle's quality is plane
    const Slow slow(mesh);
    const auto order = test::oracle::colours(mesh, slow.held, detail::colour_priority);
    for (const int count : {1, 3}) {
      const Points start = to_points(mesh);
      Points expected = start;
      for (int sweep = 0; sweep < count; ++sweep) {
        if (smart != nullptr) {
          expected = slow.sweep_smart(smart->weighting, smart->relaxation, order, expected);
        } else if (form == Form::jacobi) {
          expected = slow.sweep(method, start, expected);
        } else if (const auto* m = std::get_if<Laplacian>(&method)) {
          expected = slow.sweep_in_place(m->weighting, m->relaxation, order, expected);
        } else {
          const auto& taubin = std::get<Taubin>(method);
          for (const double factor : {taubin.lambda, taubin.mu}) {
            expected = slow.sweep_in_place(Weighting::uniform, factor, order, expected);
          }
        }
      }

      const Job job = test::smooth(mesh, sweeps(count, method, form));
      const Job rounded = test::smooth(test::as_float32(mesh), sweeps(count, method, form));

      EXPECT_LT(difference(job.mesh, expected), 1e-13) << name << ", " << count << " sweeps";
      if (smart == nullptr) {  // else a rounding may take another move
        EXPECT_LT(difference(rounded.mesh, expected), 1e-6) << name << ", " << count << " sweeps";
      }
      EXPECT_GT(difference(job.mesh, start), 1e-3) << name << ": nothing has moved";
    }
  }
}

TEST(Sweep, KnowsTheFreeNodeOfABallByHand) {
  const Job job = test::smooth(test::tet_ball(), sweeps(1, Laplacian{}));

  EXPECT_EQ(test::points(job.mesh)[6], (Vec3d{0, 0, 0}));
  EXPECT_DOUBLE_EQ(job.summary.convergence.last_max_displacement, norm(Vec3d{0.2, 0.1, -0.15}));
}

TEST(Sweep, GoesTheShareOfTheWayThatRelaxationSays) {
  const Job job = test::smooth(test::tet_ball(), sweeps(1, Laplacian{.relaxation = 0.25}));

  EXPECT_NEAR(norm(test::points(job.mesh)[6] - Vec3d{0.15, 0.075, -0.1125}), 0, 1e-16);
}

TEST(Sweep, MovesTheBoundaryWhenItIsFree) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::noisy(test::lattice(type, 3), 0.1, 4);
    SmoothOptions options = sweeps(2, Laplacian{.relaxation = 0.3});
    options.boundary = BoundaryPolicy::free;
    const Slow slow(mesh, false);
    const Points start = to_points(mesh);

    const Job job = test::smooth(mesh, options);

    EXPECT_LT(difference(job.mesh, slow.sweep(options.method, start,
                                              slow.sweep(options.method, start, start))),
              1e-13)
        << element_name(type);
    EXPECT_EQ(job.summary.nodes.fixed, 0);
  }
}

class ConvergedLaplacian : public testing::TestWithParam<Form> {};
INSTANTIATE_TEST_SUITE_P(Forms, ConvergedLaplacian,
                         testing::Values(Form::jacobi, Form::gauss_seidel, Form::asynchronous));

TEST_P(ConvergedLaplacian, IsTheSolutionOfTheSparseSystem) {
  SmoothOptions options{.method = Laplacian{},
                        .form = GetParam(),
                        .max_iterations = 100000,
                        .tolerance = {1e-13},
                        .guard = false};
  for (const auto& [name, mesh] : noisy_meshes()) {
    if (name == "sphere") continue;  // without a boundary there is nothing to hold it
    const Points expected = Slow(mesh).solve(to_points(mesh));

    const Job job = test::smooth(mesh, options);

    EXPECT_EQ(job.summary.stop_reason, StopReason::converged) << name;
    EXPECT_LT(difference(job.mesh, expected), 1e-9) << name;
  }
}

TEST_P(ConvergedLaplacian, IsTheSolutionInFloat32ToItsPrecision) {
  SmoothOptions options{.method = Laplacian{},
                        .form = GetParam(),
                        .max_iterations = 100000,
                        .tolerance = {1e-7},
                        .guard = false};
  for (const auto& [name, mesh] : noisy_meshes()) {
    if (name == "sphere") continue;
    const Points expected = Slow(mesh).solve(to_points(mesh));

    const Job job = test::smooth(test::as_float32(mesh), options);

    EXPECT_LT(difference(job.mesh, expected), 1e-5) << name;
  }
}

TEST(Taubin, KeepsASphereThatTheLaplacianShrinks) {
  const Mesh mesh = test::noisy(test::sphere(4), 0.01, 1);
  const auto radius = [](const Mesh& m) {
    double sum = 0;
    for (const Vec3d& p : test::points(m)) sum += norm(p);
    return sum / static_cast<double>(m.node_count());
  };

  const double shrunk = radius(test::smooth(mesh, sweeps(20, Laplacian{})).mesh);
  const double taubin = radius(test::smooth(mesh, sweeps(20, Taubin{})).mesh);
  const double hc = radius(test::smooth(mesh, sweeps(20, HcLaplacian{})).mesh);

  EXPECT_LT(shrunk, 0.97);
  EXPECT_NEAR(taubin, radius(mesh), 0.01);
  EXPECT_NEAR(hc, radius(mesh), 0.01);
}

TEST(WindowedSinc, IsTheFilterOfTheFormulas) {
  for (const auto& [name, mesh] : noisy_meshes()) {
    const Slow slow(mesh);
    for (const Window window : {Window::nuttall, Window::hamming}) {
      for (const double pass_band : {0.02, 0.1, 1.0}) {
        for (const int terms : {5, 20, 50}) {
          const WindowedSinc method{window, pass_band};
          const Points expected = slow.filter(method, terms, to_points(mesh));
          const std::string what =
              name + ", " + std::to_string(terms) + " terms of " + std::to_string(pass_band);

          EXPECT_LT(difference(test::smooth(mesh, sweeps(terms, method)).mesh, expected), 1e-13)
              << what;
          EXPECT_LT(difference(test::smooth(test::as_float32(mesh), sweeps(terms, method)).mesh,
                               expected),
                    1e-6)
              << what;
        }
      }
    }
  }
}

/// The positions of vtkWindowedSincPolyDataFilter 9.7.2 (PyPI), pass band 0.4, normalized
/// coordinates, for an octahedron.
TEST(WindowedSinc, IsWhatVtkMadeOfAnOctahedron) {
  const Mesh mesh = test::make_mesh({{4.1, -0.9, 0.5},
                                     {2.1, -0.95, 0.6},
                                     {3.1, 0.3, 0.4},
                                     {3, -2, 0.7},
                                     {3.2, -1, 1.3},
                                     {2.9, -0.9, -0.7}},
                                    {{ElementType::triangle, {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2,
                                                              0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5}}});
  struct Recorded {
    Window window;
    int terms;
    Points positions;
  };
  const std::vector<Recorded> all = {{Window::nuttall,
                                      20,
                                      {{3.71003711131781, -0.894005948593443, 0.443031727307826},
                                       {2.42998954272991, -0.92600713780814, 0.507034105737221},
                                       {3.09699460591019, -0.1664493257702, 0.379029348878431},
                                       {3.0329922274808, -1.63850402964629, 0.571036484166616},
                                       {3.16099698433959, -0.944517687579672, 1.08995714917464},
                                       {2.9689898490514, -0.880515309150277, -0.190090419413257}}},
                                     {Window::nuttall,
                                      50,
                                      {{3.0668417814457, -0.908328934385321, 0.466657779295991},
                                       {3.06649139846279, -0.908337693959894, 0.466675298445136},
                                       {3.06667545180046, -0.908131997364901, 0.466640260146846},
                                       {3.06665793265131, -0.908534937795239, 0.466692817594281},
                                       {3.0666929709496, -0.908342022611359, 0.466842241720223},
                                       {3.06664041350217, -0.908324503462214, 0.466491858737321}}},
                                     {Window::hamming,
                                      20,
                                      {{3.15012868349944, -0.906114715729139, 0.462098101283475},
                                       {2.98331654834146, -0.910285019108089, 0.470438708041374},
                                       {3.07091662244646, -0.812318444423367, 0.453757494525576},
                                       {3.06257601568857, -1.00415239985504, 0.478779314799273},
                                       {3.07925722920436, -0.912358319224033, 0.549792987976721},
                                       {3.05423540893067, -0.904017712466134, 0.382980852818741}}},
                                     {Window::hamming,
                                      50,
                                      {{3.06600026779324, -0.908264503422907, 0.466436418576118},
                                       {3.06738656114006, -0.908229846089237, 0.466367103908777},
                                       {3.06668499041784, -0.909083643357783, 0.466505733243458},
                                       {3.06675430508518, -0.907489406008942, 0.466297789241436},
                                       {3.0666156757505, -0.908199400779971, 0.465839780993342},
                                       {3.06682361975252, -0.908268715447312, 0.46722607434016}}}};
  for (const auto& [window, terms, positions] : all) {
    const Job job = test::smooth(mesh, sweeps(terms, WindowedSinc{window, 0.4}));

    EXPECT_LT(difference(job.mesh, positions), 1e-10) << terms;
  }
}

TEST(WindowedSinc, KeepsTheRadiusOfANoisySphereToATenthOfAPercent) {
  const Mesh mesh = test::noisy(test::sphere(5), 0.01, 1);
  const auto mean_and_spread = [](const Mesh& m) {
    double sum = 0, squares = 0;
    for (const Vec3d& p : test::points(m)) {
      sum += norm(p);
      squares += dot(p, p);
    }
    const double mean = sum / static_cast<double>(m.node_count());
    return std::pair(mean, std::sqrt(squares / static_cast<double>(m.node_count()) - mean * mean));
  };
  const auto [radius, noise] = mean_and_spread(mesh);

  for (const int terms : {20, 50}) {
    const auto [filtered, rest] =
        mean_and_spread(test::smooth(mesh, sweeps(terms, WindowedSinc{})).mesh);

    EXPECT_NEAR(filtered, radius, 1e-3 * radius) << terms;
    EXPECT_LT(rest, 0.5 * noise) << terms;
  }
}

// Without a limit on the result: whatever is inverted is pulled back once, all else is the
// filter's.
TEST(WindowedSinc, GuardsTheResultOnly) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::triangle, 9), 0.25, 3);
  SmoothOptions options = sweeps(20, WindowedSinc{});
  const Job bare = test::smooth(mesh, options);
  options.guard = true;
  const Job guarded = test::smooth(mesh, options);

  EXPECT_TRUE(test::keeps_valid_elements(mesh, guarded.mesh));
  std::int64_t other = 0;
  for (std::size_t n = 0; n < mesh.node_count(); ++n) {
    other += test::points(bare.mesh)[n] == test::points(guarded.mesh)[n] ? 0 : 1;
  }
  EXPECT_EQ(other, guarded.summary.convergence.held_node_count);
  EXPECT_EQ(guarded.summary.convergence.iteration_count, 20);
  EXPECT_EQ(guarded.summary.stop_reason, StopReason::iteration_limit);
}

TEST(WindowedSinc, DoesAllItsTermsWhateverTheTolerance) {
  const Mesh mesh = test::noisy(test::sphere(3), 0.01, 1);
  SmoothOptions options = sweeps(20, WindowedSinc{});
  const Mesh all = test::smooth(mesh, options).mesh;
  options.tolerance = {.value = 0.1};

  EXPECT_TRUE(test::same_bits(test::smooth(mesh, options).mesh, all));
}

// Between its terms lie meshes: ended early, it is a coarser filter of the same size.
TEST(WindowedSinc, GivesAMeshOfTheSameSizeWhenItEndsEarly) {
  const Mesh mesh = test::noisy(test::sphere(4), 0.01, 1);
  for (const int after : {1, 5, 12}) {
    std::atomic<bool> finish_early = false;
    JobControl control;
    control.finish_early = &finish_early;
    control.on_progress = [&](const Progress& progress) {
      if (progress.stage == Stage::iterate && progress.iteration == after) finish_early = true;
    };

    const Job job = test::smooth(mesh, sweeps(50, WindowedSinc{}), 2, control);

    EXPECT_EQ(job.summary.stop_reason, StopReason::cancelled_with_result);
    EXPECT_EQ(job.summary.convergence.iteration_count, after);
    EXPECT_NEAR(job.summary.quality_after.enclosed_volume,
                job.summary.quality_before.enclosed_volume,
                0.01 * job.summary.quality_before.enclosed_volume);
  }
}

}  // namespace
}  // namespace meshsmooth
