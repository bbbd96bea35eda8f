#pragma once

#include "smooth/cuda/sweeps/patch_sizes.hpp"
#include "smooth/cuda/sweeps/sell_rings.cuh"
#include "smooth/cuda/sweeps/sweep_batch.cuh"

namespace meshsmooth::detail {

/// A position and the sweep it belongs to, read and written at one go: whoever reads
/// it knows by itself whether it is the one awaited.
struct alignas(16) TaggedPosition {
  float x, y, z;
  int tag;

  /// Sees what any block has stored, all of it or nothing.
  static __device__ TaggedPosition load(const TaggedPosition* from) {
    unsigned long long low = 0, high = 0;
    asm volatile(
        "{ .reg .b128 whole; ld.relaxed.gpu.global.b128 whole, [%2]; mov.b128 {%0, %1}, whole; }"
        : "=l"(low), "=l"(high)
        : "l"(from)
        : "memory");
    return {__uint_as_float(static_cast<unsigned int>(low)),
            __uint_as_float(static_cast<unsigned int>(low >> 32)),
            __uint_as_float(static_cast<unsigned int>(high)), static_cast<int>(high >> 32)};
  }
  static __device__ void store(TaggedPosition* to, const TaggedPosition& value) {
    const auto joined = [](unsigned int low, unsigned int high) {
      return static_cast<unsigned long long>(high) << 32 | low;
    };
    const unsigned long long low = joined(__float_as_uint(value.x), __float_as_uint(value.y));
    const unsigned long long high =
        joined(__float_as_uint(value.z), static_cast<unsigned int>(value.tag));
    asm volatile(
        "{ .reg .b128 whole; mov.b128 whole, {%0, %1}; st.relaxed.gpu.global.b128 [%2], whole; }"
        :
        : "l"(low), "l"(high), "l"(to)
        : "memory");
  }
};

/// A node that a patch moves.
struct Mover {
  std::uint32_t word;

  static constexpr std::uint32_t kShared = 1U << 31;
  /// Its place in the patch.
  [[nodiscard]] __device__ int own() const { return static_cast<int>(word & 0xffffU); }
  /// Whether other patches read it.
  [[nodiscard]] __device__ bool shared() const { return (word & kShared) != 0; }
};

/// A block's share of the mesh in its shared memory: consecutive nodes, which lie
/// together along the curve, the rings of those that move in slices of 16-bit places,
/// and the halo. Movers are ordered by the lengths of their rings, so that slices are
/// hardly filled up.
class Patch {
 public:
  __device__ Patch(const PatchSizes& sizes, unsigned char* memory, const Surroundings& around)
      : sizes_(sizes), around_(around), first_(static_cast<int>(blockIdx.x) * sizes.nodes) {
    const auto take = [&]<class T>(T*& to, int count) {
      to = reinterpret_cast<T*>(memory);
      memory += static_cast<std::size_t>(count) * sizeof(T);
    };
    take(places_, PatchSizes::kPlaceBuffers * sizes.places());
    take(squared_moves_, 2 * sizes.nodes);
    take(entries_, sizes.entries / 4);
    take(slices_, sizes.slices());
    take(halo_nodes_, sizes.halo);
    take(ring_sizes_, sizes.nodes);
    take(movers_, sizes.nodes);
  }

  /// Before a sweep: own nodes, halo, a place of 0.
  [[nodiscard]] __device__ float4* places(int sweep) const {
    return places_ + sweep % PatchSizes::kPlaceBuffers * sizes_.places();
  }
  [[nodiscard]] __device__ bool has(int own) const {
    return static_cast<std::size_t>(first_) + own < around_.node_count;
  }
  [[nodiscard]] __device__ std::size_t node(int own) const {
    return static_cast<std::size_t>(first_) + own;
  }
  /// Squared, of the nodes in a sweep; below 0: at rest.
  [[nodiscard]] __device__ double* squared_moves(int sweep) const {
    return squared_moves_ + sweep % 2 * sizes_.nodes;
  }
  [[nodiscard]] __device__ int mover_count() const { return mover_count_; }
  [[nodiscard]] __device__ Mover mover(int index) const { return movers_[index]; }

  /// `UniformMean` of a mover.
  [[nodiscard]] __device__ Vec3<float> mean(int index, const float4* from) const {
    const int2 slice = slices_[index / kWarp];
    const Vec3<float> sum = sum_of_slice<float>(entries_ + (slice.x * kWarp + index % kWarp),
                                                slice.y, [&](std::uint16_t place) {
                                                  const float4 p = from[place];
                                                  return Vec3<float>{p.x, p.y, p.z};
                                                });
    const auto count = static_cast<float>(ring_sizes_[movers_[index].own()]);
    return {sum.x / count, sum.y / count, sum.z / count};
  }

  /// Brings everything here; all threads call. False when something does not fit.
  __device__ bool load(const Vec3<float>* positions) {
    constexpr int kMostRows = 15;  // lengths that are told apart, in rows of four
    __shared__ int row_count;
    __shared__ int first_of[kMostRows + 2];  // mover by its rows, the longest first
    __shared__ int halo_places[kWarp];
    if (thread() == 0) row_count = 0;
    if (thread() < kMostRows + 2) first_of[thread()] = 0;
    // Until the sweeps begin their places are a set of nodes, a bit for each.
    const int word_count = static_cast<int>((around_.node_count + 31) / 32);
    unsigned int* const halo_bits = reinterpret_cast<unsigned int*>(places_);
    int* const halo_before = reinterpret_cast<int*>(halo_bits + word_count);
    for (int w = thread(); w < word_count; w += threads()) halo_bits[w] = 0;
    __syncthreads();
    const auto bin_of = [](int size) { return kMostRows + 1 - min((size + 3) / 4, kMostRows); };
    const auto count_in = [](int* counters, int bin, bool counts) {
      // Threads in a row that count in the same bin get places in a row.
      const unsigned int same = __match_any_sync(kAllLanes, counts ? bin : -1);
      const int leader = __ffs(static_cast<int>(same)) - 1;
      const unsigned int lane = threadIdx.x % kWarp;
      int place = 0;
      if (counts && static_cast<int>(lane) == leader) {
        place = atomicAdd(&counters[bin], __popc(same));
      }
      return __shfl_sync(kAllLanes, place, leader) + __popc(same & ((1U << lane) - 1));
    };
    for (int own = thread(); own < sizes_.nodes; own += threads()) {
      const bool moves = has(own) && around_.fixed[node(own)] == 0;
      const int size = moves ? static_cast<int>(around_.rings.size(node(own))) : 0;
      ring_sizes_[own] = size;
      count_in(first_of, bin_of(size), size > 0);
      const NodeId* const ring = around_.rings.begin(has(own) ? node(own) : 0);
      for (int first = 0; first < size; first += 4) {
        const FourOf<NodeId> four = four_of(ring, first, size);
#pragma unroll
        for (int k = 0; k < 4; ++k) {
          const NodeId other = four.values[k];
          if (!is_own(other)) atomicOr(&halo_bits[other / 32], 1U << (other % 32));
        }
      }
    }
    __syncthreads();
    if (thread() == 0) {
      int sum = 0;
      for (int bin = 0; bin < kMostRows + 2; ++bin) {
        const int count = first_of[bin];
        first_of[bin] = sum;
        sum += count;
      }
    }
    halo_count_ = number_halo(halo_bits, halo_before, word_count, halo_places);
    mover_count_ = first_of[kMostRows + 1];
    __syncthreads();
    if (halo_count_ > sizes_.halo) return false;
    for (int own = thread(); own < sizes_.nodes; own += threads()) {
      const int size = ring_sizes_[own];
      const int at = count_in(first_of, bin_of(size), size > 0);
      if (size > 0) movers_[at] = {static_cast<std::uint32_t>(own)};
    }
    const auto place_of = [&](NodeId other) {
      if (is_own(other)) return other - first_;
      const unsigned int below = (1U << (other % 32)) - 1;
      return sizes_.nodes + halo_before[other / 32] + __popc(halo_bits[other / 32] & below);
    };
    __syncthreads();
    for (int at = thread(); at < rounded_up(mover_count_); at += threads()) {
      int longest = at < mover_count_ ? ring_sizes_[movers_[at].own()] : 0;
      for (int step = kWarp / 2; step > 0; step /= 2) {
        longest = max(longest, __shfl_xor_sync(kAllLanes, longest, step));
      }
      if (at % kWarp != 0) continue;
      const int rows = (longest + 3) / 4;
      slices_[at / kWarp] = {atomicAdd(&row_count, rows), rows};
    }
    __syncthreads();
    if (row_count * kWarp > sizes_.entries / 4) return false;

    for (int at = thread(); at < rounded_up(mover_count_); at += threads()) {
      const int2 slice = slices_[at / kWarp];
      const int own = at < mover_count_ ? movers_[at].own() : 0;
      const int size = at < mover_count_ ? ring_sizes_[own] : 0;
      const NodeId* const ring = around_.rings.begin(has(own) ? node(own) : 0);
      bool shared = false;
      for (int row = 0; row < slice.y; ++row) {
        FourOf<std::uint16_t> four;
        const FourOf<NodeId> others = four_of(ring, 4 * row, size);
#pragma unroll
        for (int k = 0; k < 4; ++k) {
          int place = sizes_.places() - 1;
          if (4 * row + k < size) {
            place = place_of(others.values[k]);
            shared |= place >= sizes_.nodes;
          }
          four.values[k] = static_cast<std::uint16_t>(place);
        }
        entries_[(slice.x + row) * kWarp + at % kWarp] = four;
      }
      if (shared) movers_[at].word |= Mover::kShared;
    }
    __syncthreads();
    for (int own = thread(); own < sizes_.nodes; own += threads()) {
      if (has(own)) put(own, positions[node(own)]);
    }
    for (int h = thread(); h < halo_count_; h += threads()) {
      const auto other = static_cast<std::size_t>(halo_nodes_[h]);
      put(sizes_.nodes + h, positions[other]);
      if (around_.fixed[other] != 0) halo_nodes_[h] = -1;
    }
    if (thread() == 0) put(sizes_.places() - 1, {0, 0, 0});
    __syncthreads();
    return true;
  }

  /// Waits for the halo's positions before `sweep`; `thread_count` threads share this.
  __device__ void await_halo(const TaggedPosition* tagged, int sweep, int thread_count) const {
    constexpr int kAtOnce = 4;
    float4* const to = places(sweep) + sizes_.nodes;
    for (int h = thread(); h < halo_count_; h += kAtOnce * thread_count) {
      int nodes[kAtOnce];
      TaggedPosition seen[kAtOnce];
#pragma unroll
      for (int k = 0; k < kAtOnce; ++k) {
        const int at = h + k * thread_count;
        nodes[k] = at < halo_count_ ? halo_nodes_[at] : -1;
        if (nodes[k] >= 0) seen[k] = TaggedPosition::load(tagged + nodes[k]);
      }
#pragma unroll
      for (int k = 0; k < kAtOnce; ++k) {
        if (nodes[k] < 0) continue;
        while (seen[k].tag != sweep) seen[k] = TaggedPosition::load(tagged + nodes[k]);
        to[h + k * thread_count] = {seen[k].x, seen[k].y, seen[k].z, 0};
      }
    }
  }

 private:
  static __device__ int thread() { return static_cast<int>(threadIdx.x); }
  static __device__ int threads() { return static_cast<int>(blockDim.x); }
  static __device__ int rounded_up(int count) { return (count + kWarp - 1) / kWarp * kWarp; }

  /// Some entries of a ring, the last again in place of what is behind it.
  static __device__ FourOf<NodeId> four_of(const NodeId* ring, int first, int size) {
    FourOf<NodeId> four{};
    if (first >= size) return four;
#pragma unroll
    for (int k = 0; k < 4; ++k) four.values[k] = ring[min(first + k, size - 1)];
    return four;
  }
  [[nodiscard]] __device__ bool is_own(NodeId node) const {
    return node >= first_ && node < first_ + sizes_.nodes;
  }
  /// Lists the nodes of the halo in order; `before[w]` becomes how many there are before
  /// the word w. All threads call; returns how many there are.
  __device__ int number_halo(const unsigned int* bits, int* before, int word_count,
                             int* warp_sums) const {
    const int each = (word_count + threads() - 1) / threads();
    const int begin = min(thread() * each, word_count), end = min(begin + each, word_count);
    int own = 0;
    for (int w = begin; w < end; ++w) own += __popc(bits[w]);
    const int lane = thread() % kWarp;
    int sum = own;  // up to and with this thread's
    for (int step = 1; step < kWarp; step *= 2) {
      const int lower = __shfl_up_sync(kAllLanes, sum, step);
      if (lane >= step) sum += lower;
    }
    if (lane == kWarp - 1) warp_sums[thread() / kWarp] = sum;
    __syncthreads();
    int total = 0, place = sum - own;
    for (int warp = 0; warp < threads() / kWarp; ++warp) {
      if (warp < thread() / kWarp) place += warp_sums[warp];
      total += warp_sums[warp];
    }
    for (int w = begin; w < end; ++w) {
      before[w] = place;
      for (unsigned int left = bits[w]; left != 0; left &= left - 1, ++place) {
        if (place < sizes_.halo) halo_nodes_[place] = 32 * w + __ffs(static_cast<int>(left)) - 1;
      }
    }
    return total;
  }
  /// Into all buffers: what does not move stays there.
  __device__ void put(int place, Vec3<float> position) const {
    for (int buffer = 0; buffer < PatchSizes::kPlaceBuffers; ++buffer) {
      places(buffer)[place] = {position.x, position.y, position.z, 0};
    }
  }

  PatchSizes sizes_;
  const Surroundings& around_;
  int first_;
  int halo_count_ = 0, mover_count_ = 0;
  float4* places_;
  double* squared_moves_;
  FourOf<std::uint16_t>* entries_;
  int* halo_nodes_;
  int2* slices_;  // first row, rows
  int* ring_sizes_;
  Mover* movers_;
};

inline constexpr unsigned long long kOpen = 1ULL << 32;

/// Counts a block that has done a sweep, above kOpen also one whose moves do not end the
/// sweeps; a warp calls.
__device__ inline void publish_moves(const SweepBatch& batch, int sweep,
                                     const double* squared_moves, int count) {
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  long long largest = -1;  // bits of doubles, which have the order of what is not below 0
  double sum = 0;
  int moved = 0;
#pragma unroll 4
  for (int at = lane; at < count; at += kWarp) {
    const double squared = squared_moves[at];
    const long long bits = __double_as_longlong(squared);
    if (squared < 0) continue;
    largest = bits > largest ? bits : largest;
    sum += squared;
    ++moved;
  }
  for (int step = kWarp / 2; step > 0; step /= 2) {
    const long long other = __shfl_xor_sync(kAllLanes, largest, step);
    largest = other > largest ? other : largest;
    sum += __shfl_xor_sync(kAllLanes, sum, step);
    moved += __shfl_xor_sync(kAllLanes, moved, step);
  }
  if (lane != 0) return;
  const bool open = moved > 0 && !is_below(word_of_move(largest), batch.tolerance);
  atomicAdd(&batch.largest[sweep], open ? kOpen + 1 : 1);
  batch.partial[static_cast<std::size_t>(sweep) * gridDim.x + blockIdx.x] = {
      moved == 0 ? 0.0 : __longlong_as_double(largest), sum, moved, 0};
}

/// Whether a sweep was the last, once all blocks have done it; one thread calls.
[[nodiscard]] __device__ inline bool all_done_below(const SweepBatch& batch, int sweep) {
  const volatile unsigned long long& word = batch.largest[sweep];
  unsigned long long seen = word;
  while (seen % kOpen < gridDim.x) seen = word;
  return seen < kOpen;
}

inline constexpr int kMostResidentMovers = 768;  // threads that move nodes

/// Form A of a mesh that the shared memories of the device hold together. Blocks
/// exchange only what lies between them, through `tagged` (two per node, by the
/// sweep's parity), and nobody waits for more than the neighbours: what a block reads
/// of sweep s, its owner replaces in sweep s + 2, for which it needs this block's s + 1:
/// rings are symmetric, so whoever is read by a moving node reads it too.
/// The last warp keeps the books: that the tolerance was met in sweep s is learnt before
/// sweep s + 2, when the positions after s are still there.
__global__ void __launch_bounds__(kMostResidentMovers + kWarp, 1)
    resident_kernel(Surroundings around, float factor, PatchSizes sizes, Vec3<float>* positions,
                    TaggedPosition* tagged, SweepBatch batch) {
  extern __shared__ __align__(16) unsigned char memory[];
  __shared__ bool stop[2];  // by the sweep's parity: fast warps are one sweep ahead
  const auto grid = cooperative_groups::this_grid();
  Patch patch(sizes, memory, around);
  const int t = static_cast<int>(threadIdx.x);
  const int threads = static_cast<int>(blockDim.x) - kWarp;  // but the clerk's
  const bool is_clerk = t >= threads;

  if (!patch.load(positions) && t == 0) atomicAdd(batch.misfits, 1U);
  for (int own = t; own < sizes.nodes; own += static_cast<int>(blockDim.x)) {
    patch.squared_moves(0)[own] = patch.squared_moves(1)[own] = -1;
    if (!patch.has(own)) continue;
    for (std::size_t parity = 0; parity < 2; ++parity) {
      TaggedPosition::store(&tagged[parity * around.node_count + patch.node(own)], {0, 0, 0, 0});
    }
  }
  if (t < 2) stop[t] = false;
  grid.sync();
  if (*static_cast<volatile unsigned int*>(batch.misfits) != 0) {
    if (blockIdx.x == 0 && t == 0) *batch.done = 0;
    return;
  }

  const auto publish = [&](int sweep) {
    publish_moves(batch, sweep, patch.squared_moves(sweep), sizes.nodes);
  };
  int done = 0;
  for (int sweep = 0;; ++sweep) {
    if (is_clerk) {
      if (t == threads && sweep > 1 && all_done_below(batch, sweep - 2)) stop[sweep % 2] = true;
    } else if (sweep > 0 && sweep < batch.most) {
      patch.await_halo(tagged + static_cast<std::size_t>(sweep % 2) * around.node_count, sweep,
                       threads);
    }
    __syncthreads();
    done = stop[sweep % 2] ? sweep - 1 : sweep;
    if (done < sweep || sweep == batch.most) break;
    if (is_clerk) {
      if (sweep > 0) publish(sweep - 1);
      continue;
    }
    const float4* const from = patch.places(sweep);
    float4* const to = patch.places(sweep + 1);
    double* const squared_moves = patch.squared_moves(sweep);
    TaggedPosition* const out =
        tagged + static_cast<std::size_t>((sweep + 1) % 2) * around.node_count;
    for (int at = t; at < patch.mover_count(); at += threads) {
      const Mover mover = patch.mover(at);
      const float4 own = from[mover.own()];
      const Vec3<float> before{own.x, own.y, own.z};
      const Vec3<float> place = step_to(patch.mean(at, from), before, factor);
      if (mover.shared()) {
        TaggedPosition::store(&out[patch.node(mover.own())],
                              {place.x, place.y, place.z, sweep + 1});
      }
      to[mover.own()] = {place.x, place.y, place.z, 0};
      const SweepStats move = stats_of_move(before, place, false);
      squared_moves[mover.own()] = move.moved == 0 ? -1.0 : move.max_squared;
    }
  }
  if (is_clerk && done == batch.most) publish(done - 1);
  const float4* const result = patch.places(done);
  for (int at = t; at < patch.mover_count(); at += static_cast<int>(blockDim.x)) {
    const int own = patch.mover(at).own();
    positions[patch.node(own)] = {result[own].x, result[own].y, result[own].z};
  }
  report(grid, batch, done);
}

/// Form A with the mesh in shared memory. False when a patch does not fit its block:
/// nothing has happened then.
inline bool run_resident_sweeps(CudaExecutor& executor, const PatchSizes& sizes,
                                Sweeper<CudaExecutor, float>& sweeper, float factor,
                                ConvergenceMonitor& watch) {
  constexpr auto kKernel = &resident_kernel;
  const Surroundings& around = sweeper.around();
  executor.allow_shared_memory<kKernel>(executor.lane().patch_limits().shared_bytes);
  const auto blocks = static_cast<unsigned int>(sizes.patches(around.node_count));
  // Small patches have more halo than nodes.
  const auto threads =
      static_cast<unsigned int>(std::clamp(sizes.nodes, 6 * kWarp, kMostResidentMovers) + kWarp);
  auto tagged = executor.allocate<TaggedPosition>(2 * around.node_count);
  return run_batches(
      executor, around.node_count, blocks, watch,
      [&](const SweepBatch& batch) {
        executor.launch_cooperative<kKernel>(blocks, threads, sizes.bytes(), around, factor, sizes,
                                             sweeper.current(), tagged.data(), batch);
      },
      [](int) {});
}

}  // namespace meshsmooth::detail
