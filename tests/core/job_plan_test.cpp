// The plan of a job: what follows from its options, and that a job holds in each of its stages no
// more than the plan says.
#include "smooth/plan/job_plan.hpp"

#include <gmock/gmock.h>
#include <oneapi/tbb/task_arena.h>

#include "core/smoothing.hpp"
#include "smooth/cpu/cpu_backend.hpp"
#include "smooth/cpu/memory_model.hpp"
#include "smooth/pipeline/pipeline.hpp"
#include "support/fit_surfaces.hpp"
#include "support/mesh_size.hpp"
#include "support/surfaces.hpp"

namespace meshsmooth {
namespace {

using detail::Aim;
using detail::ByteCount;
using detail::JobPlan;
using detail::JobStage;
using detail::MemoryPlan;
using detail::plan_job;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(JobPlan, MakesTheFormDefinite) {
  for_each_method([](const Method& method) {
    EXPECT_EQ(plan_job({.method = method}).form, forms_of(method).front()) << method_name(method);
  });
  EXPECT_EQ(plan_job({.method = Laplacian{}, .form = Form::asynchronous}).form, Form::asynchronous);
}

TEST(JobPlan, OfAMotionSweepsAsOptimizeTowardsItsInput) {
  const JobPlan plan = plan_job({.method = Move{}, .tangled = TangledPolicy::refuse});
  ASSERT_TRUE(plan.optimizer);
  EXPECT_TRUE(plan.moves);
  EXPECT_FALSE(plan.improves());
  EXPECT_EQ(plan.aim, Aim::input);
  EXPECT_EQ(plan.tangled, TangledPolicy::repair);
  EXPECT_FALSE(plan.keeps_quality);
  EXPECT_EQ(plan_job({.method = Move{.target = Target::ideal}}).aim, Aim::ideal);
}

TEST(JobPlan, KeepsBallsWhereSomethingReadsThem) {
  SmoothOptions bare{.method = Laplacian{}, .guard = false};
  EXPECT_FALSE(plan_job(bare).needs_balls);
  bare.form = Form::gauss_seidel;
  EXPECT_TRUE(plan_job(bare).needs_balls) << "for colours";
  EXPECT_TRUE(plan_job({.method = Laplacian{}}).needs_balls) << "for the guard";
  EXPECT_TRUE(plan_job({.method = Laplacian{Weighting::ball_volume}, .guard = false}).needs_balls);
}

TEST(JobPlan, KeepsQualityUnlessAReferenceHasTheShapes) {
  EXPECT_TRUE(plan_job({}).keeps_quality);
  EXPECT_TRUE(plan_job({.method = Optimize{.target = Target::input}}).keeps_quality);
  EXPECT_FALSE(plan_job({.method = Optimize{.target = Target::reference}}).keeps_quality);
  EXPECT_FALSE(plan_job({.guard = false}).keeps_quality);
  EXPECT_FALSE(plan_job({.max_iterations = 0}).keeps_quality);
  EXPECT_FALSE(plan_job({.method = Optimize{.goal = Goal::worst}}).keeps_mean);
  EXPECT_TRUE(plan_job({.report_below = 0.5}).recounts_poor);
}

/// The names of the stages in which more is held than planned.
std::vector<std::string> overruns(const MemoryPlan& plan, const ByteCount& held) {
  std::vector<std::string> names;
  for (std::size_t n = 0; n < detail::kJobStageCount; ++n) {
    const auto stage = static_cast<JobStage>(n);
    const std::int64_t planned = stage == JobStage::none ? 0 : plan.during(stage);
    if (static_cast<std::int64_t>(held.peak_of(stage)) <= planned) continue;
    names.emplace_back(detail::kJobStageNames[n]);
  }
  return names;
}

/// A job on the CPU backend, whose allocations are known by stage.
class PlannedJob {
 public:
  PlannedJob(const Mesh& mesh, const SmoothOptions& options, const JobInput& input = {})
      : plan_(plan_job(options)),
        memory_(detail::plan_memory(plan_, test::size_of(mesh, input), kThreads)) {
    Mesh result = mesh;
    const MeshTopology topology(mesh);
    const detail::JobTopology of_job(topology.view(), options, input.prescribed);
    std::visit(
        [&](auto span) {
          detail::CpuBackend backend(executor_, plan_.evaluated_detail);
          const detail::JobArrays arrays{detail::given_positions(result.positions_span(), span),
                                         span, input};
          detail::run_pipeline(backend, of_job.view(), arrays, plan_, control_);
        },
        result.positions_span());
  }

  [[nodiscard]] std::vector<std::string> overruns() {
    return meshsmooth::overruns(memory_, executor_.bytes());
  }
  [[nodiscard]] std::int64_t held(JobStage stage) {
    return static_cast<std::int64_t>(executor_.bytes().peak_of(stage));
  }
  [[nodiscard]] const MemoryPlan& memory() const { return memory_; }
  [[nodiscard]] detail::CpuExecutor& executor() { return executor_; }

 private:
  static constexpr int kThreads = 2;

  JobPlan plan_;
  MemoryPlan memory_;
  JobControl control_;
  detail::Interrupt interrupt_{control_};
  tbb::task_arena arena_{kThreads};
  detail::CpuExecutor executor_{arena_, interrupt_};
};

Mesh mesh_of(ElementType type) {
  const int n = test::oracle::is_surface(type) ? 30 : type == ElementType::pyramid ? 7 : 9;
  return test::noisy(test::lattice(type, n), 0.1, 1);
}

class EveryType : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(MemoryPlan, EveryType, testing::ValuesIn(kLinearTypes),
                         [](const auto& type) { return std::string(element_name(type.param)); });

TEST_P(EveryType, HasEveryAllocationInItsStage) {
  const Mesh mesh = mesh_of(GetParam());
  for (const test::Way& way : test::ways(true)) {
    SmoothOptions options = test::sweeps(2, way.method, way.form);
    EXPECT_THAT(PlannedJob(mesh, options).overruns(), IsEmpty()) << way.name;
    options.guard = options.never_worse = options.history = true;
    options.boundary = BoundaryPolicy::slide;
    options.movement_limit = MovementLimit{0.01, true};
    options.only_below = OnlyBelow{0.8, 1};
    EXPECT_THAT(PlannedJob(mesh, options).overruns(), IsEmpty()) << way.name << ", slides";
  }
}

TEST(MemoryPlan, HasWhatATargetSurfaceTakes) {
  const SurfaceMesh surface = test::sphere_surface(12, 8);
  for (const ElementType type : {ElementType::tetrahedron, ElementType::pyramid, ElementType::wedge,
                                 ElementType::hexahedron}) {
    const Mesh mesh = mesh_of(type);
    for (const int sweeps : {0, 1, 40}) {
      const SmoothOptions options{.max_iterations = sweeps, .boundary = BoundaryPolicy::slide};
      PlannedJob job(mesh, options, {.surface = &surface});
      EXPECT_THAT(job.overruns(), IsEmpty()) << element_name(type) << ", " << sweeps;
      EXPECT_GT(job.memory().kept, PlannedJob(mesh, options).memory().kept);
    }
  }
}

TEST_P(EveryType, HasWhatOptimizeAndAMotionTake) {
  const Mesh mesh = mesh_of(GetParam());
  const Mesh reference = test::noisy(mesh, 0.02, 2);
  for (const Goal goal : {Goal::average, Goal::balanced, Goal::worst}) {
    const SmoothOptions options{
        .method = Optimize{.goal = goal, .stay = 0.1}, .max_iterations = 20, .report_below = 0.9};
    EXPECT_THAT(PlannedJob(mesh, options).overruns(), IsEmpty());
  }
  const JobInput aims{.reference = reference.positions_view()};
  EXPECT_THAT(PlannedJob(mesh, with_target_of({.max_iterations = 20}, aims), aims).overruns(),
              IsEmpty());

  const std::vector<NodeId> nodes = find_boundary_nodes(MeshTopology(mesh).view());
  std::vector<Vec3d> to;
  for (const NodeId node : nodes) {
    const Vec3d p = test::points(mesh)[static_cast<std::size_t>(node)];
    to.push_back(p + Vec3d{0.3 * p.y, std::sin(0.1 * p.x), 0});
  }
  for (const int sweeps : {4, 20}) {
    const SmoothOptions options{.method = Move{}, .max_iterations = sweeps};
    EXPECT_THAT(
        PlannedJob(mesh, options, {.prescribed = {nodes, std::span<const Vec3d>(to)}}).overruns(),
        IsEmpty());
  }
}

TEST(MemoryPlan, HasNoMoreStagesThanItsPeak) {
  PlannedJob job(mesh_of(ElementType::tetrahedron), {.max_iterations = 2});
  std::int64_t most = 0;
  for (std::size_t n = 1; n < detail::kJobStageCount; ++n) {
    most = std::max(most, job.memory().during(static_cast<JobStage>(n)));
  }
  EXPECT_EQ(job.memory().peak(), most);
  EXPECT_EQ(job.held(JobStage::none), 0);
  EXPECT_GT(job.held(JobStage::iterate), 0);
}

TEST(MemoryPlan, TellsOfAnAllocationThatIsNotInIt) {
  PlannedJob job(mesh_of(ElementType::tetrahedron), {.max_iterations = 2});
  detail::CpuExecutor& executor = job.executor();
  const auto more = static_cast<std::size_t>(job.memory().during(JobStage::colour));
  executor.bytes().enter(JobStage::colour);
  { const auto buffer = executor.allocate<std::byte>(more + 1); }
  EXPECT_THAT(job.overruns(), ElementsAre("colour"));
  executor.bytes().enter(JobStage::none);
  { const auto buffer = executor.allocate<std::byte>(1); }
  EXPECT_THAT(job.overruns(), Contains("none"));
}

}  // namespace
}  // namespace meshsmooth
