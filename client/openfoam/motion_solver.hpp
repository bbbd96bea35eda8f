#pragma once

#include <displacementMotionSolver.H>

#include <memory>

#include "motion.hpp"

namespace Foam {

/// Motion solver "meshsmooth": the boundary values of pointDisplacement are continued into the mesh
/// by a server of meshsmooth. See docs/openfoam.md.
class meshsmoothMotionSolver : public displacementMotionSolver {
 public:
  TypeName("meshsmooth");

  meshsmoothMotionSolver(const polyMesh& mesh, const IOdictionary& dict);
  meshsmoothMotionSolver(const polyMesh& mesh, const IOdictionary& dict,
                         const pointVectorField& pointDisplacement, const pointIOField& points0);
  ~meshsmoothMotionSolver() override;

  /// At rest, plus the displacements.
  tmp<pointField> curPoints() const override;
  void solve() override;
  /// After a change of topology; the next motion sends the mesh anew.
  void updateMesh(const mapPolyMesh& map) override;

 private:
  void prepare();
  void prepare_plane(const std::vector<bool>& prescribed);
  void check_moved() const;

  std::unique_ptr<meshsmooth_foam::Service> service_;
  // What follows is made for the first motion, and after a change of topology.
  std::vector<meshsmooth_foam::CyclicMotion> cyclics_;
  std::unique_ptr<meshsmooth_foam::PartMotion> motion_;
  std::vector<label> held_;                             // points where cyclic patches meet
  std::vector<std::pair<label, label>> front_to_back_;  // points of a mesh of one layer
  bool checks_ = false;                                 // moved meshes, by OpenFOAM
};

}  // namespace Foam
