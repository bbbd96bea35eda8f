#include "merged_job.hpp"

#include <utility>
#include <variant>

namespace meshsmooth::cli {

MergedJob::MergedJob(formats::CoincidentNodes coincident, Mesh& mesh, JobInput& input)
    : mesh_(mesh),
      coincident_(std::move(coincident)),
      blocks_(mesh.blocks),
      fixed_(mesh.fixed),
      pairs_(input.node_pairs.begin(), input.node_pairs.end()) {
  coincident_.merge(mesh);
  for (NodePair& pair : pairs_) {
    for (NodeId& node : pair) node = coincident_.representative(node);
  }
  input.node_pairs = pairs_;
  if (!input.prescribed.nodes.empty()) merge_prescribed(input);
}

void MergedJob::merge_prescribed(JobInput& input) {
  std::vector<std::uint8_t> taken(mesh_.node_count(), 0);
  std::visit(
      [&](const auto& positions) {
        for (std::size_t i = 0; i < input.prescribed.nodes.size(); ++i) {
          const NodeId node = coincident_.representative(input.prescribed.nodes[i]);
          if (std::exchange(taken[static_cast<std::size_t>(node)], 1) != 0) continue;
          prescribed_.push_back(node);
          prescribed_positions_.push_back(vec3_cast<double>(positions[i]));
        }
      },
      input.prescribed.positions);
  input.prescribed = {prescribed_, std::span<const Vec3d>(prescribed_positions_)};
}

void MergedJob::undo() {
  mesh_.blocks = std::move(blocks_);
  mesh_.fixed = std::move(fixed_);
  coincident_.spread(mesh_);
}

}  // namespace meshsmooth::cli
