// Which CUDA devices there are, what is refused, and how.

#include <gmock/gmock.h>

#include <limits>

#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "support/cuda_device.hpp"

namespace meshsmooth {
namespace {

using testing::HasSubstr;

// --- which devices --------------------------------------------------------------

/// Holds with and without a device.
TEST(CudaBackend, NamesWhatThereIsWhenADeviceIsNotHere) {
  try {
    static_cast<void>(make_smoother("cuda:99"));
    FAIL() << "nothing thrown";
  } catch (const NotSupported& error) {
    EXPECT_EQ(error.reason(), "BACKEND_NOT_AVAILABLE");
    EXPECT_THAT(error.what(), HasSubstr("cuda:99"));
    for (const BackendInfo& info : list_backends()) {
      if (!info.available) continue;
      EXPECT_THAT(error.what(), HasSubstr(info.name));
    }
  }
}

TEST(CudaBackend, RefusesWhatIsNoDeviceNumber) {
  for (const std::string name : {"cuda:", "cuda:-1", "cuda:0x", "cuda0"}) {
    EXPECT_THROW(static_cast<void>(make_smoother(name)), NotSupported) << name;
  }
}

class CudaDevice : public test::CudaTest {};

TEST_F(CudaDevice, IsListedFirstWithItsName) {
  const BackendInfo first = list_backends().front();

  EXPECT_EQ(first.name, "cuda:0");
  EXPECT_TRUE(first.available);
  EXPECT_FALSE(first.device_name.empty());
}

TEST_F(CudaDevice, IsWhatAutoMeans) {
  EXPECT_EQ(make_smoother()->backend(), "cuda:0");
  EXPECT_EQ(make_smoother("cuda")->backend(), "cuda:0");
  EXPECT_EQ(make_smoother("cuda:0")->backend(), "cuda:0");
}

TEST_F(CudaDevice, StandsInTheSummary) {
  Mesh mesh = test::tet_ball();

  const SmoothSummary summary =
      make_smoother("cuda")->smooth(mesh, SmoothOptions{.method = SmartLaplacian{}});

  EXPECT_EQ(summary.backend, "cuda:0");
  EXPECT_EQ(summary.device_name, list_backends().front().device_name);
  EXPECT_GT(summary.device_peak_bytes, 0);
  EXPECT_GT(summary.times.iterate_seconds, 0);
}

// --- bad input ------------------------------------------------------------------

struct BadJob {
  std::string name;
  Mesh mesh;
  SmoothOptions options = {.method = SmartLaplacian{}};
};

template <class Change>
Mesh changed(Mesh mesh, const Change& change) {
  change(mesh);
  return mesh;
}

std::vector<BadJob> bad_jobs() {
  const Mesh lattice = test::noisy(test::lattice(ElementType::tetrahedron, 5), 0.12, 5);
  const auto with_node = [&](std::size_t place, NodeId node) {
    return changed(lattice, [=](Mesh& mesh) { mesh.blocks[0].nodes[place] = node; });
  };
  const auto with_coordinate = [&](double value) {
    return changed(lattice, [=](Mesh& mesh) { test::points(mesh)[77].y = value; });
  };
  std::vector<BadJob> jobs = {
      {"index_too_large", with_node(333, 216)},
      {"index_negative", with_node(333, -1)},
      {"index_huge", with_node(333, std::numeric_limits<NodeId>::max())},
      {"repeated_node", with_node(333, lattice.blocks[0].nodes[332])},
      {"facet_overused", test::overused_facet()},
      {"element_given_twice", changed(lattice,
                                      [](Mesh& mesh) {
                                        std::vector<NodeId>& nodes = mesh.blocks[0].nodes;
                                        nodes.insert(nodes.end(), nodes.begin(), nodes.begin() + 4);
                                      })},
      {"not_a_number", with_coordinate(std::numeric_limits<double>::quiet_NaN())},
      {"infinite", with_coordinate(-std::numeric_limits<double>::infinity())},
      {"tangled",
       test::noisy(test::lattice(ElementType::tetrahedron, 5), 0.5, 2),
       {.method = SmartLaplacian{}, .tangled = TangledPolicy::refuse}},
      {"empty", Mesh{}},
      {"half_an_element", changed(lattice, [](Mesh& mesh) { mesh.blocks[0].nodes.pop_back(); })},
      {"mask_too_short", changed(lattice, [](Mesh& mesh) { mesh.fixed.assign(3, 1); })},
      {"mixed_dimensions", changed(lattice,
                                   [](Mesh& mesh) {
                                     mesh.blocks.push_back({ElementType::triangle, {0, 1, 2}});
                                   })},
      {"relaxation_too_large", lattice, {.method = Laplacian{.relaxation = 2}}},
      {"hc_in_place", lattice, {.method = HcLaplacian{}, .form = Form::gauss_seidel}},
  };
  const std::size_t in_double = jobs.size();
  for (std::size_t j = 0; j < in_double; ++j) {
    if (jobs[j].mesh.node_count() == 0) continue;
    jobs.push_back({jobs[j].name + "_float32", test::as_float32(jobs[j].mesh), jobs[j].options});
  }
  return jobs;
}

/// "REASON: message", or "" when nothing is thrown.
std::string refusal(Smoother& smoother, const BadJob& job) {
  Mesh mesh = job.mesh;
  try {
    smoother.smooth(mesh, job.options);
  } catch (const Error& error) {
    // NaN differs from itself, but not its bits.
    EXPECT_TRUE(test::same_bits(mesh, job.mesh)) << job.name << ": positions were touched";
    return error.reason() + ": " + error.what();
  }
  return "";
}

class BadInput : public test::CudaTest {};

/// A good job after a refused one, against the CPU backend.
void expect_good_as_new(Smoother& cuda) {
  Mesh good = test::noisy(test::mixed_stack(5), 0.1, 1);
  const SmoothOptions options = test::sweeps(5, Laplacian{});
  const Mesh expected = test::smooth(good, options).mesh;

  cuda.smooth(good, options);

  EXPECT_LT(test::difference(good, test::oracle::to_points(expected)), 1e-12);
}

TEST_F(BadInput, IsRefusedInTheWordsOfTheCpuBackend) {
  const std::unique_ptr<Smoother> cpu = make_smoother("cpu", 2);
  const std::unique_ptr<Smoother> cuda = make_smoother("cuda");
  constexpr int kOftenEnough = 10;  // a good job every time would take racecheck too long
  int refused = 0;
  for (const BadJob& job : bad_jobs()) {
    const std::string expected = refusal(*cpu, job);
    ASSERT_FALSE(expected.empty()) << job.name << ": the test's own mesh is good";

    EXPECT_EQ(refusal(*cuda, job), expected) << job.name;
    if (++refused % kOftenEnough == 0) expect_good_as_new(*cuda);
  }
  expect_good_as_new(*cuda);
}

/// One test a job, so that compute-sanitizer can be given them side by side.
class BadInputOfAKind : public test::CudaTest, public testing::WithParamInterface<BadJob> {};

TEST_P(BadInputOfAKind, LeavesTheSmootherAsGoodAsNew) {
  const std::unique_ptr<Smoother> cuda = make_smoother("cuda");
  ASSERT_FALSE(refusal(*cuda, GetParam()).empty());

  expect_good_as_new(*cuda);
}

void PrintTo(const BadJob& job, std::ostream* out) { *out << job.name; }

INSTANTIATE_TEST_SUITE_P(Cuda, BadInputOfAKind, testing::ValuesIn(bad_jobs()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace meshsmooth
