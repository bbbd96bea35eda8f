#pragma once

#include <vector>

#include "coincident_nodes.hpp"
#include "meshsmooth/options.hpp"

namespace meshsmooth::cli {

/// A job on a mesh whose coincident nodes are one, while the caller's mesh keeps all of them.
class MergedJob {
 public:
  /// Merges the nodes of `mesh`, which must outlive this, and of the input, which views this then:
  /// of prescribed nodes at one position the first counts. O(nodes of elements).
  MergedJob(formats::CoincidentNodes coincident, Mesh& mesh, JobInput& input);

  [[nodiscard]] std::int64_t merged_count() const { return coincident_.merged_count(); }
  /// Gives the mesh its own elements and fixed nodes again, with the result in all nodes.
  void undo();

 private:
  void merge_prescribed(JobInput& input);

  Mesh& mesh_;
  formats::CoincidentNodes coincident_;
  std::vector<ElementBlock> blocks_;
  std::vector<std::uint8_t> fixed_;
  std::vector<NodePair> pairs_;
  std::vector<NodeId> prescribed_;
  std::vector<Vec3d> prescribed_positions_;
};

}  // namespace meshsmooth::cli
