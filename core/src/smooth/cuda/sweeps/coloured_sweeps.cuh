#pragma once

#include "smooth/cuda/primitives/warp_team.cuh"
#include "smooth/cuda/sweeps/ball_records.cuh"
#include "smooth/cuda/sweeps/padded_positions.cuh"
#include "smooth/cuda/sweeps/sweep_batch.cuh"

namespace meshsmooth::detail {

/// `UniformMean` by a team: each thread fetches two neighbours into shared memory, from where all
/// of them add up the row in its order. (Passing positions on by shuffles was slower: three for
/// each neighbour.)
template <class Team>
struct TeamMean {
  Team team;

  template <class P>
  __device__ Vec3<typename P::Real> operator()(const Surroundings& around, const P& x,
                                               std::size_t node, const NodeId* ring,
                                               int size) const {
    using Real = typename P::Real;
    if (size == 0 || size > 2 * Team::size) return UniformMean{}(around, x, node);
    __shared__ FourOf<Real> places_of[kBlockSize / Team::size][2 * Team::size];
    FourOf<Real>* const places = places_of[threadIdx.x / Team::size];
    const auto fetch = [&](int k) {
      const Vec3<Real> p = x[static_cast<std::size_t>(ring[k < size ? k : size - 1])];
      return FourOf<Real>{p.x, p.y, p.z, 0};
    };
    const FourOf<Real> first = fetch(team.rank);
    const FourOf<Real> second = fetch(team.rank + Team::size);
    places[team.rank] = first;
    places[team.rank + Team::size] = second;
    __syncwarp(team.mask);
    Vec3<Real> sum{0, 0, 0};
#pragma unroll 8
    for (int k = 0; k < size; ++k) {
      const FourOf<Real> p = places[k];
      sum += Vec3<Real>{p.values[0], p.values[1], p.values[2]};
    }
    __syncwarp(team.mask);  // before the next node's come here
    const auto count = static_cast<Real>(size);
    return {sum.x / count, sum.y / count, sum.z / count};
  }
};

/// A tetrahedron of a ball, for one thread.
template <class Real>
struct HeldTetrahedron {
  Vec3<Real> a, b, c;  // the corners that stay: own, a, b, c turn as the element does
  int own;             // the corner that moves

  template <class P>
  __device__ void load(const Elements& elements, const P& x, ElementId e, NodeId node) {
    NodeId ids[4];
    load_group(elements.runs[0].nodes + std::size_t{e} * 4, ids);
    own = ids[1] == node ? 1 : ids[2] == node ? 2 : ids[3] == node ? 3 : 0;
    const NodeId first = own == 0 ? ids[1] : ids[0];
    const NodeId second = own == 0 ? ids[2] : own == 1 ? ids[3] : own == 2 ? ids[1] : ids[2];
    const NodeId third = own == 1 ? ids[2] : own == 3 ? ids[1] : ids[3];
    a = x[static_cast<std::size_t>(first)];
    b = x[static_cast<std::size_t>(second)];
    c = x[static_cast<std::size_t>(third)];
  }
  /// `tetrahedron_quality` of the corners in the element's order, as everywhere.
  [[nodiscard]] __device__ double score(Vec3<Real> place) const {
    const Vec3<Real> p0 = own == 0 ? place : a;
    const Vec3<Real> p1 = own == 0 ? a : own == 1 ? place : own == 2 ? b : c;
    const Vec3<Real> p2 = own == 0 ? b : own == 1 ? c : own == 2 ? place : b;
    const Vec3<Real> p3 = own == 0 || own == 2 ? c : own == 1 ? b : place;
    return tetrahedron_quality(vec3_cast<double>(p0), vec3_cast<double>(p1), vec3_cast<double>(p2),
                               vec3_cast<double>(p3));
  }
};

/// What tells in single precision that a tetrahedron's score is certainly below a bar: most moves
/// are refused, and this costs a third of judging them in double.
///
/// score = 432 det^2 / L^3, L the sum of the squared edges, so it is below w when
/// det < sqrt(w / 432) L^1.5. Edges are differences of floats, each right to 2^-24 of itself; det
/// as computed is wrong by less than 14 2^-24 |u||v||w| of three edges that meet, and their product
/// is at most (L / 3)^1.5: 1.6e-7 L^1.5.
class QualityThreshold {
 public:
  __device__ explicit QualityThreshold(double worst)
      : root_((sqrtf(static_cast<float>(worst) / 432.0F) - 1e-6F) * (1 - 1e-5F)) {}

  /// Only scores above 0 can be told from lower ones.
  [[nodiscard]] __device__ bool tells() const { return root_ > 0; }

  /// The facet opposite to the node that moves.
  struct Facet {
    Vec3<float> normal;
    float length;

    __device__ explicit Facet(const HeldTetrahedron<float>& t)
        : normal(cross(t.b - t.a, t.c - t.a)),
          length(add_square(t.b - t.a, add_square(t.c - t.a, add_square(t.c - t.b, 0)))) {}
  };
  [[nodiscard]] __device__ bool is_above(const HeldTetrahedron<float>& t, const Facet& facet,
                                         Vec3<float> place) const {
    const Vec3<float> u = t.a - place;
    const float det = fmaf(facet.normal.x, u.x, fmaf(facet.normal.y, u.y, facet.normal.z * u.z));
    const float length =
        add_square(u, add_square(t.b - place, add_square(t.c - place, facet.length)));
    const float size = length * __fsqrt_rn(length);
    return det < root_ * size && size > 1e-25F && size < 1e37F;  // where float has all its digits
  }

 private:
  static __device__ float add_square(Vec3<float> v, float sum) {
    return fmaf(v.x, v.x, fmaf(v.y, v.y, fmaf(v.z, v.z, sum)));
  }

  float root_;
};

/// What a visit must know before it can ask for positions. Of the next node it is fetched while
/// this one is judged.
struct NodeVisit {
  BallRecord ball;
  ElementId element;  // of the ball, the thread's first
  const NodeId* ring;
  int ring_size;

  __device__ void find(const BallRecord& record) { ball = record; }
  template <class Team>
  __device__ void look(const Team& team, const Surroundings& around) {
    element = team.rank < ball.size ? around.balls.entries[ball.begin + team.rank] : 0;
    const std::int64_t begin = around.rings.offsets[ball.node];
    ring = around.rings.entries + begin;
    ring_size = static_cast<int>(around.rings.offsets[ball.node + 1] - begin);
  }
};

/// The ball of a node, for a team whose threads hold some tetrahedra each, so that
/// memory is read once for all trials.
template <class Team, class Real>
class HeldBall {
 public:
  /// Whether the ball is one that can be held.
  static __device__ bool fits(const Surroundings& around, const BallRecord& ball) {
    const ElementShape& shape = *around.elements.runs[0].shape;
    return ball.size <= kEach * Team::size && around.elements.run_count == 1 &&
           shape.dimension == 3 && shape.node_count == 4;
  }

  template <class P>
  __device__ HeldBall(const Team& team, const Surroundings& around, const P& x,
                      const NodeVisit& visit)
      : team_(team), size_(visit.ball.size) {
#pragma unroll
    for (int n = 0; n < kEach; ++n) {
      const int at = team.rank + n * Team::size;
      if (at >= size_) continue;
      const ElementId e = n == 0 ? visit.element : around.balls.entries[visit.ball.begin + at];
      elements_[n].load(around.elements, x, e, visit.ball.node);
    }
  }

  /// `accept_move` from `before`.
  __device__ Vec3<Real> accept_move(Vec3<Real> before, Vec3<Real> candidate, Acceptance acceptance,
                                    bool& held) const {
    if (candidate == before) return before;
    double score_before[kEach];
    double worst = 2.0;
#pragma unroll
    for (int n = 0; n < kEach; ++n) {
      score_before[n] = 0;
      if (!has(n)) continue;
      score_before[n] = elements_[n].score(before);
      if (score_before[n] < worst) worst = score_before[n];
    }
    if (acceptance.smart) worst = team_.lowest(worst);
    const unsigned int hopeless =
        acceptance.smart ? find_hopeless(before, candidate, QualityThreshold(worst)) : 0;
    Real share = 1;
    for (int trial = 0; trial < kTrials; ++trial, share /= 2) {
      bool right = (hopeless >> trial & 1U) == 0;
      if (right) {
        const Vec3<Real> place = place_of(before, candidate, trial, share);
#pragma unroll
        for (int n = 0; n < kEach; ++n) {
          if (!has(n)) continue;
          const double score = elements_[n].score(place);
          right &= !(acceptance.smart && score < worst) &&
                   !(acceptance.guard && !(score > 0) && score_before[n] > 0);
        }
        if (team_.all(right)) return place;
      }
      held = true;
    }
    return before;
  }

 private:
  static constexpr int kEach = 64 / Team::size;
  static constexpr int kTrials = 4;

  [[nodiscard]] __device__ bool has(int n) const { return team_.rank + n * Team::size < size_; }
  static __device__ Vec3<Real> place_of(Vec3<Real> before, Vec3<Real> candidate, int trial,
                                        Real share) {
    return trial == 0 ? candidate : before + share * (candidate - before);
  }

  /// The trials that would certainly lower the worst score, a bit each.
  __device__ unsigned int find_hopeless(Vec3<Real> before, Vec3<Real> candidate,
                                        const QualityThreshold& bar) const {
    unsigned int hopeless = 0;
    if constexpr (std::is_same_v<Real, float>) {
      if (!bar.tells()) return 0;
      bool below[kTrials] = {};
#pragma unroll
      for (int n = 0; n < kEach; ++n) {
        if (!has(n)) continue;
        const QualityThreshold::Facet facet(elements_[n]);
        float share = 1;
#pragma unroll
        for (int trial = 0; trial < kTrials; ++trial, share /= 2) {
          below[trial] |=
              bar.is_above(elements_[n], facet, place_of(before, candidate, trial, share));
        }
      }
#pragma unroll
      for (int trial = 0; trial < kTrials; ++trial) {
        hopeless |= (team_.all(!below[trial]) ? 0U : 1U) << trial;
      }
    }
    return hopeless;
  }

  const Team& team_;
  int size_;
  HeldTetrahedron<Real> elements_[kEach];
};

/// `move_node` with the mean of the ring, by a team: what it has to fetch is on its way at the same
/// time.
template <class Team, class P>
__device__ Vec3<typename P::Real> move_to_mean(const Team& team, const Surroundings& around,
                                               const P& x, const NodeVisit& visit,
                                               typename P::Real factor, Acceptance acceptance,
                                               bool& held) {
  using Real = typename P::Real;
  using Ball = HeldBall<Team, Real>;
  const auto node = static_cast<std::size_t>(visit.ball.node);
  const Vec3<Real> before = x[node];
  const auto candidate = [&] {
    return step_to(TeamMean<Team>{team}(around, x, node, visit.ring, visit.ring_size), before,
                   factor);
  };
  if (!acceptance.active()) return candidate();
  if (!Ball::fits(around, visit.ball)) {
    return accept_move(team, around, x, node, candidate(), acceptance, held);
  }
  const Ball ball(team, around, x, visit);
  return ball.accept_move(before, candidate(), acceptance, held);
}

/// A team of kTeam threads moves a node.
template <int kTeam, class Mean, class Real>
__global__ void __launch_bounds__(kBlockSize, 2)
    gauss_seidel_kernel(Surroundings around, Mean mean, Real factor, Acceptance acceptance,
                        const BallRecord* records, const std::uint32_t* first, int colour_count,
                        PaddedPositions<Real> x, SweepBatch batch) {
  __shared__ alignas(SweepStats) unsigned char bytes[kWarpsPerBlock * sizeof(SweepStats)];
  SweepStats* const shared = reinterpret_cast<SweepStats*>(bytes);
  const auto grid = cooperative_groups::this_grid();
  const WarpTeam<kTeam> team;
  // Known here, so that no code is made for facets.
  const Acceptance accepted{acceptance.guard, acceptance.smart, false};
  const std::uint32_t own = (blockIdx.x * kBlockSize + threadIdx.x) / kTeam;
  const std::uint32_t teams = gridDim.x * kBlockSize / kTeam;
  // What comes next is fetched before the grid waits.
  const std::uint32_t last_record = first[colour_count] - 1;
  const auto record_at = [&](std::uint32_t n) {
    return records[n < last_record ? n : last_record];
  };
  std::uint32_t n = own;
  std::uint32_t end = first[1];
  NodeVisit ahead;
  ahead.find(record_at(n));
  ahead.look(team, around);
  int sweep = 0;
  for (bool last = false; !last; ++sweep) {
    SweepStats seen;
    for (int c = 0; c < colour_count; ++c) {
      const int next_colour = c + 1 < colour_count ? c + 1 : 0;
      const std::uint32_t next_begin = first[next_colour];
      const std::uint32_t next_end = first[next_colour + 1];
      if (n >= end) {
        ahead.find(record_at(next_begin + own));
        ahead.look(team, around);
      }
      while (n < end) {
        const NodeVisit visit = ahead;
        const auto node = static_cast<std::size_t>(visit.ball.node);
        n += teams;
        ahead.find(record_at(n < end ? n : next_begin + own));
        bool held = false;
        const Vec3<Real> before = x[node];
        Vec3<Real> place;
        if constexpr (std::is_same_v<Mean, UniformMean>) {
          place = move_to_mean(team, around, x, visit, factor, accepted, held);
        } else {
          place = move_node(team, around, x, node, mean, factor, accepted, held);
        }
        ahead.look(team, around);
        __syncwarp(team.mask);
        if (team.rank != 0) continue;
        x.store(node, place);
        seen = seen + stats_of_move(before, place, held);
      }
      n = next_begin + own;
      end = next_end;
      if (c + 1 < colour_count) grid.sync();
    }
    last = end_sweep(grid, batch, sweep, seen, shared);
  }
  report(grid, batch, sweep);
}

template <int kTeam, class Real, class Mean>
void run_coloured_sweeps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper,
                         const Mean& mean, Real factor, ConvergenceMonitor& watch) {
  const Surroundings& around = sweeper.around();
  const BallRecords balls = record_balls(executor, around, sweeper.colouring());
  auto padded = executor.allocate<Real>(PaddedPositions<Real>::size(around.node_count));
  const PaddedPositions<Real> x(padded.data(), around.node_count);
  pad_positions(executor, around.node_count, sweeper.current(), x);
  constexpr auto kKernel = &gauss_seidel_kernel<kTeam, Mean, Real>;
  const unsigned int blocks =
      executor.cooperative_blocks<kKernel>(block_count(balls.largest * kTeam));
  run_batches(
      executor, around.node_count, blocks, watch,
      [&](const SweepBatch& batch) {
        executor.launch_cooperative<kKernel>(blocks, kBlockSize, 0, around, mean, factor,
                                             sweeper.acceptance(), balls.records.data(),
                                             balls.first.data(), balls.colour_count, x, batch);
      },
      [](int) {});
  unpad_positions(executor, around.node_count, x, sweeper.current());
}

}  // namespace meshsmooth::detail
