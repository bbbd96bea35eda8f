"""How far the boundary came onto a target surface: the part of the report with `surface`."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class SurfaceCounts:
    """What a target surface consists of, and what is unusual in it."""

    triangle_count: int = 0
    patch_count: int = 0  # parts between feature edges
    curve_count: int = 0  # chains of feature edges between corners, and loops
    corner_count: int = 0
    open_edge_count: int = 0  # of one triangle
    non_manifold_edge_count: int = 0  # of three or more
    degenerate_triangle_count: int = 0  # without an area; ignored


@dataclass(frozen=True)
class SurfaceDistance:
    """Distances, in the mesh's unit."""

    largest: float = 0.0
    mean: float = 0.0


@dataclass(frozen=True)
class TargetPart:
    """The nodes of a patch or a curve of a target surface."""

    curve: bool = False
    node_count: int = 0
    distance: SurfaceDistance = field(default_factory=SurfaceDistance)  # in the result


@dataclass(frozen=True)
class Fit:
    """How far the boundary came onto a target surface.

    Attributes:
        surface: what it consists of.
        node_count: nodes of the boundary with a place on the surface.
        reached_count: of these, those that lie there in the result.
        held_count: of the rest, those that elements would not stay valid with.
        fixed_count: nodes of the boundary without a place: fixed, between regions, or in a pair.
        unmatched_corner_count: corners of the surface without a node.
        unmatched_curve_count: curves of the surface without a path of edges.
        step_count: steps towards the surface.
        input_off_surface: nodes lay farther off than 1e-6 of the box; never_worse does not apply.
        input_to_surface: distances of the nodes from where they belong, in the input.
        result_to_surface: the same, in the result.
        surface_to_result: distances of the surface's points from the boundary's facets.
        parts: the patches, then the curves; none if there are more than 1,000.
    """

    surface: SurfaceCounts = field(default_factory=SurfaceCounts)
    node_count: int = 0
    reached_count: int = 0
    held_count: int = 0
    fixed_count: int = 0
    unmatched_corner_count: int = 0
    unmatched_curve_count: int = 0
    step_count: int = 0
    input_off_surface: bool = False
    input_to_surface: SurfaceDistance = field(default_factory=SurfaceDistance)
    result_to_surface: SurfaceDistance = field(default_factory=SurfaceDistance)
    surface_to_result: SurfaceDistance = field(default_factory=SurfaceDistance)
    parts: tuple[TargetPart, ...] = ()

    @property
    def reached(self) -> float:
        """The share of the nodes that lie where they belong, [0, 1]."""
        return self.reached_count / self.node_count if self.node_count else 1.0
