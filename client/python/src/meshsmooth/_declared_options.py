"""The keywords of jobs, each with its type, default, unit, meaning, and field on the wire.

Made by scripts/tables from proto/declaration; do not edit.
"""
# fmt: off
# ruff: noqa: E501

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, Any, Literal, TypedDict

from ._methods import (
    Backend,
    Boundary,
    Detail,
    Form,
    Goal,
    Method,
    MethodName,
    Metric,
    Priority,
    Tangled,
    Target,
)
from ._option import Duration, Nodes, Numbers, Option, Vectors
from ._progress import Progress


class JobOptions(TypedDict, total=False):
    """The keywords of `smooth` and of whatever else starts a job.

    Durations are seconds, text as in "500ms", "30s", "10min", or a `timedelta`. A mask of nodes
    has the type bool; indices count from 0; a name is that of a node array (not 0: chosen) or set.
    """

    method: Annotated[Method | MethodName, Option("how nodes move", default="'optimize'", takes="ms.Optimize(…) and the like, or {choices}")]
    goal: Annotated[Goal, Option("elements that optimize improves", default="'balanced'")]
    target: Annotated[Target, Option("shape that elements aim at, of optimize and move", default="'automatic'")]
    stay: Annotated[float, Option("weight by which optimize holds nodes where they were, 0 or more", default="0")]
    iterations: Annotated[int, Option("most sweeps, 0: only evaluate; taubin and windowed-sinc 20, hc-laplacian 10", default="1000", field="max_iteration_count")]
    tolerance: Annotated[float, Option("largest move, or decrease of optimize's energy, that ends the job", default="1e-4", unit="share of the diagonal, or of the energy", field="convergence_tolerance")]
    absolute_tolerance: Annotated[float, Option("largest move that ends the job", unit="length", field="absolute_tolerance")]
    target_quality: Annotated[float, Option("worst mean ratio that ends optimize, [0, 1)", default="0", unit="mean ratio", field="target_quality")]
    compute_budget: Annotated[Duration, Option("computing time after which the best result so far is returned", takes="seconds, text or timedelta", field="compute_budget")]
    boundary: Annotated[Boundary, Option("what nodes on the boundary do", default="'fixed'", field="boundary_policy", topology=True)]
    feature_angle: Annotated[float, Option("angle at which facets form a crease", default="30", unit="°", field="feature_angle_degrees")]
    fixed: Annotated[Nodes, Option("nodes that stay", takes="mask, indices, name or names", topology=True)]
    fixed_types: Annotated[Sequence[str], Option("cell types whose nodes stay, as in ['wedge']", takes="names of types", topology=True)]
    regions: Annotated[Numbers | str | None, Option("cells whose interfaces are kept as the boundary is; 'auto': physical groups", default="'auto'", takes="whole number per cell, name or None", topology=True)]
    merge_coincident: Annotated[bool, Option("nodes at one position are smoothed as one", default="False", topology=True)]
    periodic: Annotated[Any, Option("nodes that belong together, which are held", takes="pairs of sides, or array [pairs, 2]")]
    file_pairs: Annotated[bool, Option("nodes that the mesh itself pairs, as gmsh's periodic ones, are held too", default="True")]
    movement_limit: Annotated[float | str, Option("farthest that a node may go", unit="length, or share of the diagonal as in '2%'")]
    only_below: Annotated[float, Option("only elements of lower quality are improved, (0, 1]", unit="mean ratio", field="only_below")]
    only_below_rings: Annotated[int, Option("rings of nodes around these that move too", default="2", field="only_below_rings")]
    reference: Annotated[Any, Option("mesh from which elements take their shape", takes="mesh or positions")]
    surface: Annotated[Any, Option("surface on which the boundary's nodes shall lie; boundary='slide' then", takes="surface mesh")]
    guard: Annotated[bool, Option("valid elements stay valid; False: they may not", default="True", field="guard")]
    never_worse: Annotated[bool, Option("nodes go back where the result would be worse", default="True", field="never_worse")]
    metric: Annotated[Literal["mean_ratio", "scaled_jacobian"], Option("what never_worse keeps; else the least values of both. 'scaled_jacobian': optimize also raises its least value", field="metric")]
    tangled: Annotated[Tangled, Option("what happens to a mesh with inverted elements", default="'repair'", field="tangled_policy")]
    report_below: Annotated[float, Option("elements of lower quality are counted by what holds them: summary.poor, (0, 1]", unit="mean ratio", field="report_below")]
    form: Annotated[Form, Option("order of the moves in a sweep; else the method's own", field="form")]
    history: Annotated[bool, Option("the summary has the moves of each sweep", default="False", field="spec.iteration_history_included")]
    quality: Annotated[Detail, Option("'brief': no metrics, counts only", default="'full'", field="spec.quality_detail")]
    element_quality: Annotated[Metric | Sequence[Metric], Option("metrics of each element: cell arrays of the result, and result.element_quality", takes="one or more of {choices}")]
    backend: Annotated[Backend, Option("where the server computes", default="'auto'", field="spec.backend_kind")]
    priority: Annotated[Priority, Option("whose jobs go first", default="'normal'", field="spec.priority")]
    queue_timeout: Annotated[Duration, Option("longest wait in the queue", takes="seconds, text or timedelta", field="spec.queue_timeout")]
    timeout: Annotated[Duration, Option("of all attempts together", default="by the mesh's size", takes="seconds, text or timedelta")]
    result_ttl: Annotated[Duration, Option("time that the server keeps the result for attach", takes="seconds, text or timedelta", field="spec.result_ttl")]
    request_id: Annotated[str, Option("UUID under which the same job is joined", default="a new one")]
    traceparent: Annotated[str, Option("span of the caller, in the format of W3C Trace Context", default="none")]
    max_attempts: Annotated[int, Option("attempts where the server is busy or gone", default="4")]
    progress: Annotated[bool | Callable[[Progress], object], Option("True: shown; a function gets an ms.Progress, returning False cancels", default="False", takes="bool or function")]


class MoveOptions(JobOptions, total=False):
    """The keywords of `move`: those of `smooth`, and how the mesh moves."""

    displacement: Annotated[Vectors | str, Option("motion of the prescribed nodes", takes="array [nodes, 2 or 3] or name")]
    to: Annotated[Any, Option("in its place, where they go", takes="array [nodes, 2 or 3], or mesh")]
    prescribed: Annotated[Nodes, Option("nodes that move by it", default="those on the boundary that are not fixed", takes="mask, indices, name or names")]
