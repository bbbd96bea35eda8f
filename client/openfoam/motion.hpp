#pragma once

#include <cyclicPolyPatch.H>
#include <pointPatchField.H>

#include <memory>
#include <utility>
#include <vector>

#include "part.hpp"
#include "service.hpp"

namespace meshsmooth_foam {

/// Moves one part from step to step. Laplace's equation on the mesh of an earlier step, the base,
/// of which the server keeps the matrix, continues what the prescribed points have done since.
/// Where that costs an element half of its shape, sweeps bring back the shapes that elements have
/// at rest, and the result is the next base: what the steps do to elements does not add up.
class PartMotion {
 public:
  /// @param rest the part at rest, of this mesh
  /// @param prescribed [points of the mesh]: those whose displacement is given
  PartMotion(const Service& service, const Foam::polyMesh& mesh, Part rest,
             const std::vector<bool>& prescribed);

  /// Whether there are polyhedra or polygons.
  [[nodiscard]] bool has_polyhedra() const { return part_.divided; }
  /// Continues the displacements of the prescribed points to the others of the part.
  /// @param displacement [points of the mesh], from rest
  void move(Foam::vectorField& displacement);

 private:
  struct FreeSession {
    void operator()(meshsmooth_session* session) const { meshsmooth_session_free(session); }
  };
  using Session = std::unique_ptr<meshsmooth_session, FreeSession>;

  [[nodiscard]] Session open(const std::vector<Foam::vector>& positions, bool shapes) const;
  [[nodiscard]] std::vector<Foam::vector> prescribed_positions(
      const Foam::vectorField& displacement) const;
  /// Changes `current_` where all of the motion is reached, or `share` of it.
  meshsmooth_summary move_from_base(const std::vector<Foam::vector>& positions,
                                    const meshsmooth_options& options, double share);
  void restore_shapes();

  const Service& service_;
  const Part part_;
  std::vector<std::int32_t> prescribed_;  // nodes
  std::vector<std::uint8_t> fixed_;       // [nodes], prescribed
  std::vector<Foam::vector> current_;     // [nodes], where the last step left them
  Session shapes_;                        // with the mesh at rest as its reference
  Session base_;                          // none: the current mesh becomes the base
};

/// A cyclic patch with its partner: the points of one side move in their plane, those of the other
/// side do the same.
class CyclicMotion {
 public:
  /// @param prescribed by the user's patch fields. The points of both sides are added.
  CyclicMotion(const Service& service, const Foam::cyclicPolyPatch& patch,
               const Foam::pointField& points, std::vector<bool>& prescribed);

  /// @param displacement all points of both sides are set
  void move(Foam::vectorField& displacement);

 private:
  const Foam::cyclicPolyPatch& patch_;
  const Foam::tensor to_other_;                             // turns a displacement
  std::vector<std::pair<Foam::label, Foam::label>> pairs_;  // points of this side and the other
  std::vector<bool> given_;                                 // [pairs], by the user's patch fields
  double tolerance_ = 0;
  std::unique_ptr<PartMotion> motion_;  // none: the others stay
};

}  // namespace meshsmooth_foam
