#pragma once

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth::detail {

/// Ids inside a job are 32-bit: throws NotSupported (MESH_TOO_LARGE) for more.
void refuse_too_large(const TopologyView& topology);

/// Throws the InvalidMesh (FACET_OVERUSED) of a facet that more than two elements of a volume mesh
/// use, which names an element that is there twice. Called once a backend has found that there is
/// one; O(elements log elements).
[[noreturn]] void throw_overused_facet(const TopologyView& topology);

/// Throws InvalidMesh (MESH_TANGLED) where there are inverted elements and the policy is to refuse.
void refuse_tangled(const QualityStats& quality, TangledPolicy policy);

/// Throws InvalidMesh (REFERENCE_TANGLED) where a mesh to move is not valid before it moves.
void refuse_tangled_reference(const QualityStats& quality);

/// Throws NotSupported (OPTION_NOT_SUPPORTED): the mesh to move is a curved surface.
[[noreturn]] void refuse_moving_surface();

/// Throws NotSupported (OPTION_NOT_SUPPORTED) for a target surface unless all elements are volume
/// elements of first order.
void refuse_surface_on(const TopologyView& topology, const JobInput& input);

/// Throws InvalidMesh (SURFACE_INVALID) for a mesh whose distances from a surface may be infinite.
void refuse_beyond_surfaces(Vec3d lower, Vec3d upper);

/// Throws InvalidMesh (REFERENCE_FLAT) where all of a reference's elements are flat or inverted.
void refuse_flat_reference(std::int64_t flat_count, std::size_t element_count);

}  // namespace meshsmooth::detail
