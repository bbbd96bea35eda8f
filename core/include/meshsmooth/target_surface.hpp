#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "meshsmooth/vec3.hpp"

namespace meshsmooth {

/// A surface of triangles, as a file or a caller has it.
struct SurfaceMesh {
  std::vector<Vec3d> points;                            ///< In the mesh's unit.
  std::vector<std::array<std::int32_t, 3>> triangles;   ///< Indices of points.
  std::vector<std::array<std::int32_t, 2>> edges = {};  ///< Features besides those found.
  std::vector<std::int32_t> corners = {};               ///< Points that are corners in any case.
  /// One per triangle: edges between two of them are features. Or empty.
  std::vector<std::int32_t> patches = {};
};

/// What a `TargetSurface` consists of, and what is unusual in it.
struct SurfaceCounts {
  std::int64_t triangles = 0;
  std::int64_t patches = 0;  ///< Parts between feature edges.
  std::int64_t curves = 0;   ///< Chains of feature edges between corners, and loops.
  std::int64_t corners = 0;
  std::int64_t open_edges = 0;            ///< Of one triangle; they are features.
  std::int64_t non_manifold_edges = 0;    ///< Of three or more; they are features.
  std::int64_t degenerate_triangles = 0;  ///< Without area; ignored.
};

/// The largest coordinate of a surface, and of meshes on one: products of areas are finite.
inline constexpr double kMostSurfaceCoordinate = 1e60;

/// Checks what can be told of a surface without computing: O(points + triangles).
///
/// @throws InvalidMesh SURFACE_INVALID: no triangle, an index out of range, a coordinate that is
///         not finite or beyond `kMostSurfaceCoordinate`, patches of another number than triangles
void validate_surface(const SurfaceMesh& mesh);

namespace detail {
class SurfaceTrees;
}

/// A surface on which boundary nodes are to lie: its patches, the curves between them, corners, and
/// a tree of boxes for each patch and curve. Points with equal coordinates are one; the orientation
/// of the triangles does not matter. Immutable; may be used concurrently.
class TargetSurface {
 public:
  /// Feature edges are those at which triangles turn by more than the angle, those of one or of
  /// more than two triangles, between two patches, and the given ones. Corners are the ends of
  /// feature edges where not just two meet, or two that turn by more than 45 degrees, or by more
  /// than the angle if that is larger. O(triangles log triangles).
  ///
  /// @param feature_angle  in degrees, [1, 90]
  /// @param bends          edges that are no features, as `trees` numbers points
  /// @param check          called about every millisecond; what it throws ends the constructor
  /// @throws InvalidMesh SURFACE_INVALID: no triangle has an area; as `validate_surface`
  explicit TargetSurface(const SurfaceMesh& mesh, double feature_angle = 30,
                         std::span<const std::array<std::int32_t, 2>> bends = {},
                         const std::function<void()>& check = {});
  ~TargetSurface();
  TargetSurface(const TargetSurface&) = delete;
  TargetSurface& operator=(const TargetSurface&) = delete;

  [[nodiscard]] const SurfaceCounts& counts() const { return counts_; }
  /// @returns an upper bound of what it and its constructor hold, from the sizes
  [[nodiscard]] static std::int64_t estimate_bytes(std::int64_t points, std::int64_t triangles);

  [[nodiscard]] const detail::SurfaceTrees& trees() const { return *trees_; }

 private:
  SurfaceCounts counts_;
  std::unique_ptr<const detail::SurfaceTrees> trees_;
};

}  // namespace meshsmooth
