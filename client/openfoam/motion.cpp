#include "motion.hpp"

#include <SubField.H>
#include <boundBox.H>

#include <algorithm>
#include <numeric>
#include <utility>

namespace meshsmooth_foam {

using Foam::label;
using Foam::vector;
using Foam::vectorField;

PartMotion::PartMotion(const Service& service, const Foam::polyMesh& mesh, Part rest,
                       const std::vector<bool>& prescribed)
    : service_(service),
      part_(std::move(rest)),
      fixed_(part_.positions.size(), 0),
      current_(positions_of(part_, mesh, mesh.points())) {
  for (std::size_t node = 0; node < part_.points.size(); ++node) {
    const label point = part_.points[node];
    if (point >= 0 && prescribed[point]) prescribed_.push_back(static_cast<std::int32_t>(node));
  }
  for (const std::int32_t node : prescribed_) fixed_[static_cast<std::size_t>(node)] = 1;
  shapes_ = open(part_.positions, true);
}

PartMotion::Session PartMotion::open(const std::vector<vector>& positions, bool shapes) const {
  std::vector<meshsmooth_block> blocks;
  for (std::size_t type = 0; type < part_.elements.size(); ++type) {
    const Elements& elements = part_.elements[type];
    if (elements.origins.empty()) continue;
    blocks.push_back({static_cast<std::int64_t>(type),
                      static_cast<std::int64_t>(elements.origins.size()), elements.nodes.data()});
  }
  static_assert(sizeof(vector) == 3 * sizeof(double), "OpenFOAM in double precision");
  meshsmooth_mesh mesh{};
  mesh.size = sizeof mesh;
  mesh.scalar = MESHSMOOTH_FLOAT64;
  mesh.node_count = static_cast<std::int64_t>(positions.size());
  mesh.positions = positions.data();
  mesh.block_count = static_cast<std::int64_t>(blocks.size());
  mesh.blocks = blocks.data();
  if (shapes) {
    mesh.fixed = fixed_.data();
    mesh.reference = part_.positions.data();
  }
  meshsmooth_session* session = nullptr;
  meshsmooth_error* error = nullptr;
  const NoTraps scope;
  meshsmooth_session_create(service_.client(), &mesh, &session, &error);
  check(error, &part_);
  return Session(session);
}

void PartMotion::move(vectorField& displacement) {
  const std::vector<vector> positions = prescribed_positions(displacement);
  if (!base_) base_ = open(current_, false);
  meshsmooth_summary moved = move_from_base(positions, service_.quick_motion(), 1);
  if (moved.motion_reached < 1) {
    base_ = open(current_, false);
    moved = move_from_base(positions, service_.motion(), service_.least_share());
  }
  if (moved.motion_reached < service_.least_share()) {
    FatalErrorInFunction << "meshsmooth: only " << 100 * moved.motion_reached
                         << " % of the step can be made with valid elements" << Foam::nl
                         << "Make shorter steps, or accept less by the entry \"leastShare\""
                         << Foam::exit(Foam::FatalError);
  }
  if (moved.motion_reached < 1) {
    Foam::Warning << "meshsmooth: the boundary comes " << 100 * moved.motion_reached
                  << " % of its way" << Foam::endl;
  }
  if (moved.iteration_count > 0) {
    restore_shapes();
    base_.reset();
  }
  // What is prescribed keeps its bits, and its part across a plane.
  const bool whole = moved.motion_reached >= 1;
  for (std::size_t node = 0; node < current_.size(); ++node) {
    if (part_.points[node] < 0 || (whole && fixed_[node] != 0)) continue;
    displacement[part_.points[node]] = (current_[node] - part_.positions[node]) & part_.axes;
  }
}

std::vector<vector> PartMotion::prescribed_positions(const vectorField& displacement) const {
  std::vector<vector> positions;
  for (const std::int32_t prescribed : prescribed_) {
    const auto node = static_cast<std::size_t>(prescribed);
    vector along = part_.axes & displacement[part_.points[node]];
    if (part_.plane) along.z() = 0;
    positions.push_back(part_.positions[node] + along);
  }
  return positions;
}

meshsmooth_summary PartMotion::move_from_base(const std::vector<vector>& positions,
                                              const meshsmooth_options& options, double share) {
  meshsmooth_prescribed prescribed{};
  prescribed.size = sizeof prescribed;
  prescribed.node_count = static_cast<std::int64_t>(prescribed_.size());
  prescribed.nodes = prescribed_.data();
  prescribed.positions = positions.data();
  std::vector<vector> result(current_.size());
  meshsmooth_summary summary{};
  summary.size = sizeof summary;
  meshsmooth_error* error = nullptr;
  meshsmooth_report* report = nullptr;
  {
    const NoTraps scope;
    if (meshsmooth_session_move(base_.get(), &prescribed, &options, nullptr, result.data(), &report,
                                &error) == MESHSMOOTH_OK) {
      meshsmooth_report_summary(report, &summary, &error);
    }
    meshsmooth_report_free(report);
  }
  check(error, &part_);
  if (summary.motion_reached >= share) current_ = std::move(result);
  return summary;
}

void PartMotion::restore_shapes() {
  meshsmooth_summary summary{};
  summary.size = sizeof summary;
  meshsmooth_error* error = nullptr;
  meshsmooth_report* report = nullptr;
  {
    const NoTraps scope;
    if (meshsmooth_session_smooth(shapes_.get(), current_.data(), &service_.sweeps(), nullptr,
                                  current_.data(), &report, &error) == MESHSMOOTH_OK) {
      meshsmooth_report_summary(report, &summary, &error);
    }
    meshsmooth_report_free(report);
  }
  check(error, &part_);
  Foam::Info << "meshsmooth: " << label(summary.node_count) << " nodes, "
             << label(summary.iteration_count) << " sweeps, least mean ratio "
             << summary.min_mean_ratio_after << Foam::endl;
}

CyclicMotion::CyclicMotion(const Service& service, const Foam::cyclicPolyPatch& patch,
                           const Foam::pointField& points, std::vector<bool>& prescribed)
    : patch_(patch), to_other_(patch.parallel() ? Foam::tensor::I : patch.reverseT()[0]) {
  const Foam::labelList& own = patch.meshPoints();
  const Foam::labelList& other = patch.neighbPatch().meshPoints();
  for (const Foam::edge& pair : patch.coupledPoints()) {
    pairs_.emplace_back(own[pair.first()], other[pair.second()]);
  }
  const Foam::pointField places(points, own);
  const double extent = Foam::boundBox(places, false).mag();
  tolerance_ = 1e-5 * extent;
  bool moving = false;
  bool free = false;
  for (const auto& [here, there] : pairs_) {
    if (prescribed[here] != prescribed[there]) {
      FatalErrorInFunction << "Of the points " << here << " and " << there << ", which belong "
                           << "together by the cyclic patch " << patch.name()
                           << ", one alone has a displacement by a patch field" << Foam::nl
                           << "Give it to both" << Foam::exit(Foam::FatalError);
    }
    given_.push_back(prescribed[here]);
    (prescribed[here] ? moving : free) = true;
  }
  const vector area = Foam::sum(patch.faceAreas());
  const vector normal = area / Foam::mag(area);
  const bool plane = std::all_of(places.begin(), places.end(), [&](const vector& place) {
    return std::abs((place - places[0]) & normal) <= 1e-6 * extent;
  });
  if (free && !plane) {
    Foam::Info << "meshsmooth: the points of the cyclic patch " << patch.name()
               << ", which is not plane, stay unless their displacement is given" << Foam::endl;
  }
  if (free && moving && plane) {
    const Foam::polyMesh& mesh = patch.boundaryMesh().mesh();
    Foam::labelList faces(patch.size());
    std::iota(faces.begin(), faces.end(), patch.start());
    motion_ = std::make_unique<PartMotion>(service, mesh, plane_of(mesh, points, faces, normal),
                                           prescribed);
  }
  for (const auto& [here, there] : pairs_) prescribed[here] = prescribed[there] = true;
}

void CyclicMotion::move(vectorField& displacement) {
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const auto& [here, there] = pairs_[i];
    if (!given_[i]) displacement[here] = Foam::Zero;
    if (given_[i] &&
        Foam::mag((to_other_ & displacement[here]) - displacement[there]) > tolerance_) {
      FatalErrorInFunction << "The points " << here << " and " << there << ", which belong "
                           << "together by the cyclic patch " << patch_.name()
                           << ", have the displacements " << displacement[here] << " and "
                           << displacement[there] << " by their patch fields" << Foam::nl
                           << "They must match, for the patches to do so"
                           << Foam::exit(Foam::FatalError);
    }
  }
  if (motion_) motion_->move(displacement);
  for (const auto& [here, there] : pairs_) {
    displacement[there] = to_other_ & displacement[here];
  }
}

}  // namespace meshsmooth_foam
