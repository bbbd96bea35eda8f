#pragma once

// The steps of the pipeline on one mesh, one by one, with their answers in the
// caller's ids.

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "core/by_sorting.hpp"
#include "smooth/cpu/colouring.hpp"
#include "smooth/cpu/prepare.hpp"
#include "support/oracle.hpp"

namespace meshsmooth::test {

class Steps {
 public:
  explicit Steps(const Mesh& mesh, int threads = 2)
      : topology_(mesh), arena_(threads), executor_(arena_, interrupt_) {
    const TopologyView view = topology_.view();
    node_count_ = view.node_count;
    box_ = detail::find_box(executor_, points(mesh).data(), node_count_);
    numbers_ = detail::renumber_nodes(executor_, points(mesh).data(), node_count_, box_);
    elements_ = detail::renumber_elements(executor_, view, numbers_.internal_of.data());
    balls_ =
        detail::find_balls(executor_, node_count_, elements_.view, elements_.caller_ids.data());
  }

  [[nodiscard]] std::vector<NodeId> caller_ids_of_nodes() const {
    return {numbers_.caller_ids.data(), numbers_.caller_ids.data() + node_count_};
  }
  [[nodiscard]] std::vector<std::vector<std::int64_t>> balls() const {
    return rows<std::int64_t>(balls_.view(), elements_.caller_ids.data());
  }
  [[nodiscard]] std::vector<std::vector<NodeId>> rings() {
    return rows<NodeId>(find_rings().view(), numbers_.caller_ids.data());
  }
  [[nodiscard]] std::vector<std::vector<NodeId>> rings_by_sorting() {
    const auto found = detail::find_rings_by_sorting(executor_, node_count_, elements_.view,
                                                     numbers_.caller_ids.data());
    return rows<NodeId>(found.view(), numbers_.caller_ids.data());
  }
  [[nodiscard]] std::set<NodeId> boundary() { return marked(marks(), detail::kOnBoundary); }
  [[nodiscard]] std::set<NodeId> non_manifold() {
    return marked(marks(), detail::kOnNonManifoldEdge);
  }
  [[nodiscard]] std::set<NodeId> boundary_by_sorting() {
    std::vector<std::uint8_t> marks(node_count_, 7);
    if (!detail::find_boundary_by_sorting(executor_, node_count_, elements_.view, marks.data())) {
      detail::throw_overused_facet(topology_.view());
    }
    return marked(marks, detail::kOnBoundary);
  }
  /// Colour by colour, ascending inside, where `held` nodes have none.
  [[nodiscard]] std::vector<std::vector<NodeId>> colours(const std::vector<bool>& held) {
    std::vector<std::uint8_t> fixed(node_count_);
    for (std::size_t n = 0; n < node_count_; ++n) {
      fixed[n] = held[numbers_.caller_ids.data()[n]] ? 1 : 0;
    }
    const auto rings = find_rings();
    const detail::Surroundings around{node_count_,  elements_.view, rings.view(), balls_.view(),
                                      fixed.data(), nullptr,        {0, 0, 0}};
    const auto colouring = detail::colour_nodes(executor_, around, numbers_.caller_ids.data());
    std::vector<std::vector<NodeId>> result;
    for (std::size_t c = 0; c < colouring.count(); ++c) {
      result.emplace_back();
      for (std::size_t n = colouring.first[c]; n < colouring.first[c + 1]; ++n) {
        result.back().push_back(numbers_.caller_ids.data()[colouring.nodes.data()[n]]);
      }
      std::sort(result.back().begin(), result.back().end());
    }
    return result;
  }

 private:
  detail::RowBuffer<detail::CpuExecutor, NodeId> find_rings() {
    return detail::find_rings(executor_, node_count_, elements_.view, balls_.view(),
                              numbers_.caller_ids.data());
  }

  template <class Out, class Id, class Caller>
  [[nodiscard]] std::vector<std::vector<Out>> rows(const detail::Rows<Id>& found,
                                                   const Caller* caller_ids) const {
    std::vector<std::vector<Out>> result(node_count_);
    for (std::size_t n = 0; n < node_count_; ++n) {
      std::vector<Out>& row = result[numbers_.caller_ids.data()[n]];
      for (const Id* id = found.begin(n); id != found.end(n); ++id) row.push_back(caller_ids[*id]);
    }
    return result;
  }
  [[nodiscard]] std::vector<std::uint8_t> marks() {
    std::vector<std::uint8_t> marks(node_count_, 7);
    if (!detail::find_boundary(executor_, node_count_, elements_.view, balls_.view(),
                               marks.data())) {
      detail::throw_overused_facet(topology_.view());
    }
    return marks;
  }
  [[nodiscard]] std::set<NodeId> marked(const std::vector<std::uint8_t>& marks,
                                        std::uint8_t mark) const {
    std::set<NodeId> result;
    for (std::size_t n = 0; n < node_count_; ++n) {
      EXPECT_LE(marks[n], detail::kOnNonManifoldEdge) << "a node was left out";
      if (marks[n] == mark) result.insert(numbers_.caller_ids.data()[n]);
    }
    return result;
  }

  tbb::global_control enough_threads_{tbb::global_control::max_allowed_parallelism, 8};
  MeshTopology topology_;
  JobControl control_;
  detail::Interrupt interrupt_{control_};
  tbb::task_arena arena_;
  detail::CpuExecutor executor_;
  std::size_t node_count_ = 0;
  detail::Box box_{};
  detail::Renumbering numbers_;
  detail::JobElements<detail::CpuExecutor> elements_;
  detail::RowBuffer<detail::CpuExecutor, detail::ElementId> balls_;
};

/// Meshes on which every step is tested, by name.
inline std::vector<std::pair<std::string, Mesh>> step_meshes() {
  std::vector<std::pair<std::string, Mesh>> meshes = {
      {"two_tets", two_tets()},
      {"tet_ball", tet_ball()},
      {"triangle_ring", triangle_ring()},
      {"open_cone", open_cone()},
      {"sphere", sphere(3)},
      {"mixed_stack", noisy(mixed_stack(5), 0.1, 1)},
      {"disconnected_pieces", disconnected_pieces()},
      {"isolated_node", with_isolated_node(lattice(ElementType::wedge, 2))},
      {"many_chunks", noisy(lattice(ElementType::tetrahedron, 17), 0.1, 2)},
  };
  for (const ElementType type : kLinearTypes) {
    meshes.emplace_back("single_" + std::string(element_name(type)), single(type));
    meshes.emplace_back("lattice_" + std::string(element_name(type)),
                        noisy(lattice(type, 5), 0.1, 3));
  }
  return meshes;
}

/// Rows as lists, from the oracle's sets.
template <class Id>
std::vector<std::vector<Id>> as_lists(const std::vector<std::set<Id>>& sets) {
  std::vector<std::vector<Id>> result;
  for (const std::set<Id>& set : sets) result.emplace_back(set.begin(), set.end());
  return result;
}

}  // namespace meshsmooth::test
