#pragma once

// A `FlatMesh` in the memory of a backend.

#include "gpu/steps/flat_mesh.hpp"
#include "smooth/guard/sweep_context.hpp"

namespace meshsmooth::test {

template <class E, class T>
typename E::template Buffer<T> uploaded(E& executor, const std::vector<T>& host) {
  auto buffer = executor.template allocate<T>(host.size());
  executor.upload(host.data(), host.size(), buffer.data());
  executor.synchronize();
  return buffer;
}
template <class T, class E>
std::vector<T> downloaded(E& executor, const T* from, std::size_t count) {
  std::vector<T> host(count);
  executor.download(from, count, host.data());
  return host;
}

/// Positions in another precision.
template <class Real, class From>
std::vector<Vec3<Real>> positions_as(const std::vector<Vec3<From>>& positions) {
  std::vector<Vec3<Real>> result;
  for (const Vec3<From>& p : positions) result.push_back(vec3_cast<Real>(p));
  return result;
}

/// `shapes` is the element table in the executor's memory.
template <class E, class Real>
struct OnExecutor {
  OnExecutor(E& executor, const FlatMesh& flat, const ElementShape* shapes)
      : caller_ids(uploaded(executor, flat.caller_ids)),
        positions(uploaded(executor, positions_as<Real>(flat.positions))),
        fixed(uploaded(executor, flat.fixed)),
        element_caller_ids(uploaded(executor, flat.element_caller_ids)),
        ring_offsets(uploaded(executor, flat.ring_offsets)),
        ring_entries(uploaded(executor, flat.ring_entries)),
        ball_offsets(uploaded(executor, flat.ball_offsets)),
        ball_entries(uploaded(executor, flat.ball_entries)),
        references(uploaded(executor, flat.references)) {
    constexpr std::size_t kAlignment = 4;  // ids between which runs may begin
    std::vector<NodeId> nodes;
    std::vector<std::size_t> begins;
    for (const FlatMesh::Run& run : flat.runs) {
      begins.push_back(nodes.size());
      nodes.insert(nodes.end(), run.nodes.begin(), run.nodes.end());
      nodes.resize((nodes.size() + kAlignment - 1) / kAlignment * kAlignment);
    }
    connectivity = uploaded(executor, nodes);
    detail::Elements elements;
    for (std::size_t r = 0; r < flat.runs.size(); ++r) {
      const ElementType type = flat.runs[r].type;
      elements.runs[elements.run_count++] = {shapes + static_cast<std::size_t>(type),
                                             connectivity.data() + begins[r], elements.count};
      elements.count += flat.runs[r].nodes.size() / element_width(type);
    }
    around = {.node_count = flat.node_count(),
              .elements = elements,
              .rings = {ring_offsets.data(), ring_entries.data()},
              .balls = {ball_offsets.data(), ball_entries.data()},
              .fixed = fixed.data(),
              .references = flat.references.empty() ? nullptr : references.data(),
              .reference = flat.reference};
    colouring.nodes = uploaded(executor, flat.colour_nodes);
    colouring.first = flat.colour_first;
  }

  [[nodiscard]] detail::SweepContext<E, Real> context(const detail::Acceptance& acceptance) const {
    return {around, &colouring, acceptance};
  }

  template <class T>
  using Buffer = typename E::template Buffer<T>;

  Buffer<NodeId> caller_ids;
  Buffer<Vec3<Real>> positions;
  Buffer<std::uint8_t> fixed;
  Buffer<std::uint32_t> element_caller_ids;
  Buffer<std::int64_t> ring_offsets;
  Buffer<NodeId> ring_entries;
  Buffer<std::int64_t> ball_offsets;
  Buffer<std::uint32_t> ball_entries;
  Buffer<PackedDirection> references;
  Buffer<NodeId> connectivity;
  detail::Surroundings around{};
  detail::Colouring<E> colouring;
};

}  // namespace meshsmooth::test
