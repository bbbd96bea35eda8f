// What the CPU backend does in vectors, against the rules node by node.

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <random>

#include "core/smoothing.hpp"
#include "smooth/cpu/colouring.hpp"
#include "smooth/cpu/optimize_phase.hpp"
#include "support/oracle.hpp"

namespace meshsmooth {
namespace {

using namespace detail;

/// A mesh of one type as the sweeps see it, in the caller's ids.
class Prepared {
 public:
  explicit Prepared(Mesh given) : mesh_(std::move(given)), executor_(arena_, interrupt_) {
    const ElementBlock& block = mesh_.blocks[0];
    elements_.runs[0] = {&element_shape(block.type), block.nodes.data(), 0};
    elements_.run_count = 1;
    elements_.count = block.nodes.size() / element_shape(block.type).node_count;
    elements_.tetrahedra = block.type == ElementType::tetrahedron;
    fill(balls_, test::oracle::balls(mesh_));
    fill(rings_, test::oracle::rings(mesh_));
    for (const bool held : test::oracle::held_nodes(mesh_)) fixed_.push_back(held ? 1 : 0);
    opposite_ = find_opposite_nodes(executor_, around());
  }

  [[nodiscard]] Surroundings around() const {
    return {mesh_.node_count(), elements_,
            rings_.view(),      balls_.view(),
            fixed_.data(),      nullptr,
            {0, 0, 0},          opposite_.size() > 0 ? opposite_.data() : nullptr};
  }
  [[nodiscard]] std::vector<Vec3d>& positions() { return test::points(mesh_); }
  [[nodiscard]] CpuExecutor& executor() { return executor_; }

 private:
  template <class Id>
  struct Lists {
    std::vector<std::int64_t> offsets = {0};
    std::vector<Id> entries;
    [[nodiscard]] Rows<Id> view() const { return {offsets.data(), entries.data()}; }
  };
  template <class Id, class Sets>
  static void fill(Lists<Id>& lists, const Sets& sets) {
    for (const auto& set : sets) {
      for (const auto id : set) lists.entries.push_back(static_cast<Id>(id));
      lists.offsets.push_back(static_cast<std::int64_t>(lists.entries.size()));
    }
  }

  tbb::global_control enough_threads_{tbb::global_control::max_allowed_parallelism, 4};
  Mesh mesh_;
  JobControl control_;
  Interrupt interrupt_{control_};
  tbb::task_arena arena_{4};
  CpuExecutor executor_;
  Elements elements_{};
  Lists<ElementId> balls_;
  Lists<NodeId> rings_;
  std::vector<std::uint8_t> fixed_;
  CpuBuffer<NodeId> opposite_;
};

/// Valid in most places, with some elements inverted.
Mesh rough() { return test::noisy(test::lattice(ElementType::tetrahedron, 9), 0.45, 3); }

TEST(HeldBall, AcceptsWhatTheRuleAccepts) {
  Prepared mesh(rough());
  const Surroundings around = mesh.around();
  const QuietPositions<double> x{mesh.positions().data()};
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> step(-0.2, 0.2);
  std::array<int, 5> taken{};  // by where a move ended: whole, …, undone
  for (const Acceptance acceptance : {Acceptance{true, false}, {false, true}, {true, true}}) {
    for (std::size_t node = 0; node < around.node_count; ++node) {
      const Vec3d before = x[node];
      const Vec3d candidate = before + Vec3d{step(random), step(random), step(random)};
      bool held = false, expected_held = false;
      const Vec3d position =
          accept_move(CpuThread{}, around, x, node, candidate, {acceptance}, held);
      const Vec3d expected =
          accept_move(SingleThread{}, around, x, node, candidate, {acceptance}, expected_held);
      EXPECT_EQ(position, expected) << node;
      EXPECT_EQ(held, expected_held) << node;
      const double share = norm(position - before) / norm(candidate - before);
      ++taken[share > 0.9 ? 0 : share > 0.4 ? 1 : share > 0.2 ? 2 : share > 0 ? 3 : 4];
    }
  }
  for (const int count : taken) EXPECT_GT(count, 0);
}

/// Against the ideal tetrahedron, or those of a reference mesh.
template <bool kReference>
void compare_with_ball_terms() {
  Prepared mesh(rough());
  Surroundings around = mesh.around();
  const QuietPositions<double> x{mesh.positions().data()};
  const Mesh reference = test::noisy(test::lattice(ElementType::tetrahedron, 9), 0.1, 5);
  if (kReference) {
    around.targets.reference = std::get<std::vector<Vec3d>>(reference.positions).data();
  }
  const SingleThread thread;
  int valid = 0, invalid = 0;
  const auto compare = [&](std::size_t node, const BallEnergy& energy, Vec3d d) {
    using Terms = TetrahedronTerms<QuietPositions<double>, kReference>;
    ASSERT_TRUE(Terms::fit(around, node));
    const Terms terms(around, x, node);
    const BallTerms<3, 96, SingleThread, QuietPositions<double>> plain(thread, around, x, node,
                                                                       {0, 0, 0});
    const BallDerivatives at = differentiate<3>(thread, terms, energy);
    const BallDerivatives expected = differentiate<3>(thread, plain, energy);
    EXPECT_EQ(at.energy, expected.energy);
    EXPECT_EQ(energy_at<3>(thread, terms, energy, d, true),
              energy_at<3>(thread, plain, energy, d, true));
    EXPECT_EQ(worst_inverse_ratio<3>(thread, terms, d), worst_inverse_ratio<3>(thread, plain, d));
    ++(expected.valid() ? valid : invalid);
    if (!expected.valid()) return;
    EXPECT_EQ(at.gradient, expected.gradient);
    for (const auto entry : {&BallDerivatives::xx, &BallDerivatives::xy, &BallDerivatives::xz,
                             &BallDerivatives::yy, &BallDerivatives::yz, &BallDerivatives::zz}) {
      EXPECT_EQ(at.*entry, expected.*entry);
    }
  };
  for (std::size_t node = 0; node < around.node_count; ++node) {
    for (const BallEnergy& energy :
         {BallEnergy{.power = 1}, BallEnergy{.power = 2}, BallEnergy{.power = 16, .unit = 1.7},
          BallEnergy{.power = 1, .epsilon_squared = 1e-5}}) {
      const auto both = [&] { compare(node, energy, {0.01, -0.02, 0.015}); };
      run_wide(both);
      run_plainly(both);
    }
  }
  EXPECT_GT(valid, 100);
  EXPECT_GT(invalid, 100);
}

TEST(TetrahedronTerms, GiveTheBitsOfBallTerms) { compare_with_ball_terms<false>(); }

TEST(TetrahedronTerms, GiveTheBitsOfBallTermsAgainstAReference) { compare_with_ball_terms<true>(); }

}  // namespace
}  // namespace meshsmooth
