#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "meshsmooth/quality.hpp"
#include "smooth/base/byte_count.hpp"
#include "smooth/linear/laplace_system.hpp"

namespace meshsmooth::detail {

/// A Laplace system that several jobs use, and the nodes that are fixed in it.
template <Executor E>
struct SharedSystem {
  LaplaceSystem<E> system;
  typename E::template Buffer<std::uint8_t> fixed;

  template <class Visit>
  void for_each_buffer(const Visit& visit) {
    const auto visit_all = [&](auto&... buffers) { (visit(buffers), ...); };
    visit_all(fixed, system.values, system.weights, system.hierarchy.inverse);
    for (CoarseLevel<E>& level : system.hierarchy.levels) {
      Interpolation<E>& by = level.interpolation;
      visit_all(level.weights, by.rows.offsets, by.rows.entries, by.values, by.columns.offsets,
                by.columns.entries, by.column_values, level.matrix.rows.offsets,
                level.matrix.rows.entries, level.matrix.values, level.matrix.excess);
    }
  }
};

/// What jobs of `Move` share that begin at the reference of a prepared topology: its quality, and
/// the newest system, for those that fix the same nodes. Thread-safe.
template <Executor E>
class KeptReference {
 public:
  /// `most_bytes`: what it may hold.
  explicit KeptReference(std::int64_t most_bytes) : most_bytes_(most_bytes) {}

  [[nodiscard]] std::int64_t most_bytes() const { return most_bytes_; }
  [[nodiscard]] ByteCount& count() { return count_; }

  /// The quality of the reference; `measure()` finds it.
  template <class Measure>
  [[nodiscard]] QualityStats quality(QualityDetail detail, const Measure& measure) {
    auto& known = qualities_[detail == QualityDetail::full ? 1 : 0];
    {
      const std::lock_guard lock(mutex_);
      if (known) return *known;
    }
    QualityStats measured = measure();
    const std::lock_guard lock(mutex_);
    known = measured;
    return measured;
  }

  /// Null: no system with these fixed nodes is kept. O(nodes).
  [[nodiscard]] std::shared_ptr<const SharedSystem<E>> find(E& executor,
                                                            const Surroundings& around) {
    std::shared_ptr<const SharedSystem<E>> kept;
    {
      const std::lock_guard lock(mutex_);
      kept = newest_;
    }
    if (!kept) return nullptr;
    executor.hold(kept);
    const std::uint8_t* const fixed = kept->fixed.data();
    const bool same = executor.reduce(
        around.node_count, true,
        [=] MESHSMOOTH_HD(std::size_t node) {
          return (fixed[node] != 0) == (around.fixed[node] != 0);
        },
        [] MESHSMOOTH_HD(bool a, bool b) { return a && b; });
    return same ? kept : nullptr;
  }

  /// Keeps a system of a job in place of an older one that no job uses. O(bytes).
  template <class B>
  void offer(B& backend, const Surroundings& around,
             const std::shared_ptr<SharedSystem<E>>& system) {
    E& executor = backend.executor();
    std::size_t bytes = around.node_count * (1 + 2 * sizeof(Vec3f));
    system->for_each_buffer(
        [&](const auto& buffer) { bytes += buffer.size() * sizeof(*buffer.data()); });
    if (static_cast<std::int64_t>(bytes) > most_bytes_) return;
    const std::lock_guard lock(mutex_);
    if (newest_.use_count() > 1) return;
    newest_ = nullptr;
    system->fixed = executor.template allocate<std::uint8_t>(around.node_count);
    std::uint8_t* const fixed = system->fixed.data();
    executor.for_each(around.node_count,
                      [=] MESHSMOOTH_HD(std::size_t node) { fixed[node] = around.fixed[node]; });
    system->for_each_buffer([&](auto& buffer) { backend.keep(buffer); });
    executor.synchronize();  // others may use it from now on
    newest_ = system;
    warm_motions_ = 0;
  }

  /// Continues the last two warm motions with a system linearly, at its free nodes. False: there
  /// is none.
  [[nodiscard]] bool extrapolate(E& executor, const Surroundings& around,
                                 const SharedSystem<E>* system, Vec3f* u) {
    const std::lock_guard lock(mutex_);
    if (newest_.get() != system || warm_motions_ == 0) return false;
    const Vec3f* const last = last_.data();
    const Vec3f* const before = warm_motions_ > 1 ? before_.data() : last;
    executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      if (around.fixed[node] == 0) u[node] = 2.0F * last[node] - before[node];
    });
    executor.synchronize();  // others may replace them from now on
    return true;
  }
  /// Keeps the displacement of a warm motion.
  template <class B>
  void remember(B& backend, const Surroundings& around, const SharedSystem<E>* system,
                const Vec3f* u) {
    E& executor = backend.executor();
    const std::lock_guard lock(mutex_);
    if (newest_.get() != system) return;
    std::swap(last_, before_);
    if (last_.size() == 0) {
      last_ = executor.template allocate<Vec3f>(around.node_count);
      backend.keep(last_);
    }
    Vec3f* const last = last_.data();
    executor.for_each(around.node_count,
                      [=] MESHSMOOTH_HD(std::size_t node) { last[node] = u[node]; });
    executor.synchronize();  // others may read it from now on
    ++warm_motions_;
  }

 private:
  const std::int64_t most_bytes_;
  ByteCount count_;  // of the buffers, so before them
  std::mutex mutex_;
  std::optional<QualityStats> qualities_[2];  // brief, full
  std::shared_ptr<const SharedSystem<E>> newest_;
  typename E::template Buffer<Vec3f> last_, before_;  // displacements of warm motions
  std::int64_t warm_motions_ = 0;                     // with the newest system
};

/// The system of a job: the kept one, or a new one, which is then kept if anything is.
template <class B, class Real>
std::shared_ptr<const SharedSystem<typename B::Executor>> find_system(B& backend,
                                                                      const Surroundings& around,
                                                                      std::size_t ring_entries,
                                                                      const Vec3<Real>* positions) {
  using E = typename B::Executor;
  E& executor = backend.executor();
  KeptReference<E>* const kept = backend.kept_reference();
  if (kept != nullptr) {
    if (auto found = kept->find(executor, around)) return found;
  }
  auto system = std::make_shared<SharedSystem<E>>();
  executor.hold(system);
  system->system = build_laplace_system(executor, around, ring_entries, positions, kept != nullptr);
  if (kept != nullptr) {
    kept->offer(backend, around, system);
  }
  return system;
}

}  // namespace meshsmooth::detail
