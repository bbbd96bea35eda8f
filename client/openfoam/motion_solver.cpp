#include "motion_solver.hpp"

#include <addToRunTimeSelectionTable.H>
#include <emptyPolyPatch.H>
#include <valuePointPatchFields.H>

#include <algorithm>

namespace Foam {

defineTypeNameAndDebug(meshsmoothMotionSolver, 0);
addToRunTimeSelectionTable(motionSolver, meshsmoothMotionSolver, dictionary);
addToRunTimeSelectionTable(displacementMotionSolver, meshsmoothMotionSolver, displacement);

meshsmoothMotionSolver::meshsmoothMotionSolver(const polyMesh& mesh, const IOdictionary& dict)
    : displacementMotionSolver(mesh, dict, typeName),
      service_(std::make_unique<meshsmooth_foam::Service>(coeffDict())) {}

meshsmoothMotionSolver::meshsmoothMotionSolver(const polyMesh& mesh, const IOdictionary& dict,
                                               const pointVectorField& pointDisplacement,
                                               const pointIOField& points0)
    : displacementMotionSolver(mesh, dict, pointDisplacement, points0, typeName),
      service_(std::make_unique<meshsmooth_foam::Service>(coeffDict())) {}

meshsmoothMotionSolver::~meshsmoothMotionSolver() = default;

tmp<pointField> meshsmoothMotionSolver::curPoints() const {
  tmp<pointField> moved(new pointField(points0() + pointDisplacement_.primitiveField()));
  if (front_to_back_.empty()) twoDCorrectPoints(moved.ref());  // wedges
  return moved;
}

void meshsmoothMotionSolver::solve() {
  if (Pstream::parRun()) {
    FatalErrorInFunction << "The motion solver meshsmooth works in one process" << nl
                         << "Run the case without -parallel; the server uses all cores" << nl
                         << exit(FatalError);
  }
  pointDisplacement_.correctBoundaryConditions();
  if (!motion_) prepare();
  vectorField& displacement = pointDisplacement_.primitiveFieldRef();
  for (const label point : held_) displacement[point] = Zero;
  for (auto& cyclic : cyclics_) cyclic.move(displacement);
  motion_->move(displacement);
  for (const auto& [front, back] : front_to_back_) displacement[back] = displacement[front];
  check_moved();
}

void meshsmoothMotionSolver::updateMesh(const mapPolyMesh& map) {
  displacementMotionSolver::updateMesh(map);
  motion_.reset();
}

void meshsmoothMotionSolver::prepare() {
  std::vector<bool> prescribed(mesh().nPoints(), false);
  for (const pointPatchVectorField& field : pointDisplacement_.boundaryField()) {
    if (!isA<valuePointPatchField<vector>>(field)) continue;
    for (const label point : field.patch().meshPoints()) prescribed[point] = true;
  }

  std::vector<int> cyclic_count(mesh().nPoints(), 0);
  for (const polyPatch& patch : mesh().boundaryMesh()) {
    if (!isA<cyclicPolyPatch>(patch)) continue;
    for (const label point : patch.meshPoints()) ++cyclic_count[point];
  }
  held_.clear();
  for (label point = 0; point < mesh().nPoints(); ++point) {
    if (cyclic_count[point] < 2 || prescribed[point]) continue;
    held_.push_back(point);
    prescribed[point] = true;
  }
  cyclics_.clear();
  for (const polyPatch& patch : mesh().boundaryMesh()) {
    if (!isA<cyclicPolyPatch>(patch)) continue;
    const auto& cyclic = refCast<const cyclicPolyPatch>(patch);
    if (cyclic.owner()) cyclics_.emplace_back(*service_, cyclic, points0(), prescribed);
  }

  front_to_back_.clear();
  if (mesh().nSolutionD() == 2) {
    prepare_plane(prescribed);
  } else {
    motion_ = std::make_unique<meshsmooth_foam::PartMotion>(
        *service_, mesh(), meshsmooth_foam::cells_of(mesh(), points0()), prescribed);
  }
  // Of the other cells the service knows for certain that they are valid.
  checks_ = coeffDict().lookupOrDefault<bool>("check", motion_->has_polyhedra());
  if (checks_ && mesh().checkMeshMotion(points0())) {
    WarningInFunction << "The mesh at rest fails OpenFOAM's own checks (checkMesh), so moved "
                         "meshes are not checked by them"
                      << endl;
    checks_ = false;
  }
}

/// A mesh of one layer between empty patches moves as its front does.
void meshsmoothMotionSolver::prepare_plane(const std::vector<bool>& prescribed) {
  vector normal = Zero;
  for (direction axis = 0; axis < 3; ++axis) normal[axis] = mesh().solutionD()[axis] < 0 ? 1 : 0;
  labelList faces;
  std::vector<bool> front(mesh().nPoints(), false);
  for (const polyPatch& patch : mesh().boundaryMesh()) {
    if (!isA<emptyPolyPatch>(patch)) continue;
    forAll(patch, i) {
      if ((patch[i].areaNormal(points0()) & normal) <= 0) continue;
      faces.append(patch.start() + i);
      for (const label point : patch[i]) front[point] = true;
    }
  }
  for (const edge& across : mesh().edges()) {
    if (front[across.start()] == front[across.end()]) continue;
    front_to_back_.emplace_back(front[across.start()] ? across.start() : across.end(),
                                front[across.start()] ? across.end() : across.start());
  }
  motion_ = std::make_unique<meshsmooth_foam::PartMotion>(
      *service_, mesh(), meshsmooth_foam::plane_of(mesh(), points0(), faces, normal), prescribed);
}

void meshsmoothMotionSolver::check_moved() const {
  if (!checks_) return;
  const tmp<pointField> moved = curPoints();
  if (!mesh().checkMeshMotion(moved())) return;
  mesh().checkMeshMotion(moved(), true, true);  // names what fails
  FatalErrorInFunction << "The moved mesh fails OpenFOAM's own checks, as reported above" << nl
                       << exit(FatalError);
}

}  // namespace Foam
