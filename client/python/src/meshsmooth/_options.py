"""Methods and options, as callers write them, to the messages of the wire.

What is unset stays unset: the server's default holds, which `Client.info()` and the summary report.
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any, Literal, TypedDict, cast

from google.protobuf import duration_pb2
from numpy.typing import ArrayLike

from ._errors import InvalidOption
from ._methods import NAMED_METHODS, Goal, Method, MethodName, Move, Optimize, Target
from ._progress import Progress
from .v1 import smoothing_pb2 as pb

Boundary = Literal["fixed", "slide", "free"]
Form = Literal["jacobi", "gauss-seidel", "asynchronous"]
Metric = Literal[
    "mean_ratio",
    "scaled_jacobian",
    "radius_ratio",
    "min_dihedral_angle",
    "max_dihedral_angle",
    "min_angle",
    "max_angle",
]
Duration = float | str | datetime.timedelta

# Fields that are called otherwise on the wire.
_WIRE_NAMES = {"lambda_": "lambda", "relaxation": "relaxation_factor"}
_CHOICES = {
    "goal": (pb.Goal, "GOAL_"),
    "target": (pb.Target, "TARGET_"),
    "weighting": (pb.Weighting, "WEIGHTING_"),
    "start": (pb.Start, "START_"),
    "window": (pb.Window, "WINDOW_"),
    "boundary": (pb.BoundaryPolicy, "BOUNDARY_POLICY_"),
    "form": (pb.Form, "FORM_"),
    "tangled": (pb.TangledPolicy, "TANGLED_POLICY_"),
    "backend": (pb.BackendKind, "BACKEND_KIND_"),
    "priority": (pb.Priority, "PRIORITY_"),
    "quality": (pb.QualityDetail, "QUALITY_DETAIL_"),
    "element_quality": (pb.QualityMetric, "QUALITY_METRIC_"),
    "metric": (pb.QualityMetric, "QUALITY_METRIC_"),
}


class JobOptions(TypedDict, total=False):
    """The keywords of `smooth` and of whatever else starts a job; docs/python.md explains each.

    Lengths are in the mesh's unit; durations are seconds, "10min" or a timedelta.
    """

    method: Method | MethodName
    goal: Goal  # the three fields of Optimize, for short; target is one of Move too
    target: Target
    stay: float
    iterations: int
    tolerance: float  # share of the bounding box's diagonal; optimize: of the energy
    absolute_tolerance: float  # length
    boundary: Boundary
    feature_angle: float  # degrees
    fixed: ArrayLike | str | Sequence[str] | None
    fixed_types: Sequence[str]
    regions: ArrayLike | str | None
    merge_coincident: bool  # nodes at one position are smoothed as one
    periodic: Any  # [pairs, 2], or sides that match: held
    reference: Any
    guard: bool
    never_worse: bool  # nodes go back where the result would be worse than the input
    metric: Literal["mean_ratio", "scaled_jacobian"]  # of never_worse
    tangled: Literal["repair", "refuse"]
    target_quality: float
    movement_limit: float | str  # length, or "2%" of the diagonal
    only_below: float
    only_below_rings: int
    report_below: float  # mean ratio against the target: Summary.poor
    form: Form
    compute_budget: Duration
    history: bool
    quality: Literal["full", "brief"]
    element_quality: Metric | Sequence[Metric]
    backend: Literal["auto", "cpu", "cuda"]
    priority: Literal["batch", "normal", "interactive"]
    queue_timeout: Duration
    timeout: Duration
    result_ttl: Duration
    request_id: str
    max_attempts: int
    progress: bool | Callable[[Progress], object]


class MoveOptions(JobOptions, total=False):
    """The keywords of `move`: those of `smooth`, and how the mesh moves."""

    displacement: ArrayLike | str  # [nodes, 2 or 3], or the name of a node array
    to: Any  # positions, or a mesh with the same elements
    prescribed: ArrayLike | str | Sequence[str] | None


def out_of_range(field: str, what: str) -> InvalidOption:
    """Returns the error of an option with a value that it cannot have."""
    return InvalidOption(what, reason="OPTION_OUT_OF_RANGE", details={"field": field})


def misplaced(field: str, what: str) -> InvalidOption:
    """Returns the error of an option that means nothing where it is."""
    return InvalidOption(what, reason="OPTION_MISPLACED", details={"field": field})


def to_choice(field: str, value: Any) -> Any:
    """Returns the number of an enumerator by the command line's name."""
    enum, prefix = _CHOICES[field]
    names = [name.removeprefix(prefix).lower() for name in enum.keys()]  # noqa: SIM118
    names.remove("unspecified")
    if isinstance(value, str):
        name = value.lower().replace("-", "_")
        if name in names:
            return enum.Value(prefix + name.upper())
    separator = "_" if field in ("element_quality", "metric") else "-"
    known = ", ".join(name.replace("_", separator) for name in names)
    raise out_of_range(field, f"{field} is {value!r}, it must be one of {known}")


_SECONDS = {"ms": 1e-3, "s": 1, "min": 60, "h": 3600, "d": 86400}


def to_seconds(field: str, value: Duration) -> float:
    """Returns a duration in seconds; it must be above 0."""
    seconds: float | None = None
    if isinstance(value, datetime.timedelta):
        seconds = value.total_seconds()
    elif isinstance(value, str):
        match = re.fullmatch(r"\s*([\d.]+(?:e[+-]?\d+)?)\s*(ms|s|min|h|d)\s*", value)
        if match:
            seconds = float(match[1]) * _SECONDS[match[2]]
    elif not isinstance(value, bool):
        seconds = float(value)
    if seconds is None or not seconds > 0:
        raise out_of_range(
            field, f'{field} is {value!r}, it must be above 0 seconds, or as "10min" and "500ms"'
        )
    return seconds


def to_duration(field: str, value: Duration) -> duration_pb2.Duration:
    """The same as a message."""
    whole = min(to_seconds(field, value), 1e10)
    return duration_pb2.Duration(seconds=int(whole), nanos=int(whole % 1 * 1e9))


def to_method(options: JobOptions) -> Method | None:
    """Returns the method of a job; None: the server's default, which is optimize."""
    method = options.get("method")
    if isinstance(method, str):
        name = method.replace("_", "-")
        if name not in NAMED_METHODS:
            raise out_of_range(
                "method", f"method is {method!r}, it must be one of {', '.join(NAMED_METHODS)}"
            )
        method = NAMED_METHODS[name]
    elif method is not None and not isinstance(method, Method):
        raise out_of_range("method", f"method is {method!r}, it must be a name or ms.Optimize(…)")
    short: dict[str, Any] = {
        field.name: options[field.name]  # type: ignore[literal-required]
        for field in fields(Optimize)
        if options.get(field.name) is not None
    }
    if not short:
        # Servers know this option of a method that is named only.
        if method is None and options.get("target_quality") is not None:
            return Optimize()
        return method
    plain = Optimize() if method is None else method
    if plain != type(plain)() or not all(hasattr(plain, name) for name in short):
        name = next(iter(short))
        owner = type(plain).__name__ if hasattr(plain, name) else "Optimize"
        raise misplaced(name, f"{name} is a field of ms.{owner}; with ms.{owner}(…) it goes there")
    return replace(plain, **short)


_MOTION = MoveOptions.__annotations__.keys() - JobOptions.__annotations__.keys()


def to_move_options(options: JobOptions) -> JobOptions:
    """Returns the options of `move` as those of a job: with the method, without the motion."""
    method = options.get("method") or "move"
    if method != "move" and not isinstance(method, Move):
        raise misplaced("method", f"move has the method ms.Move(…), not {method!r}")
    others = {name: value for name, value in options.items() if name not in _MOTION}
    return cast("JobOptions", others | {"method": method})


def default_iterations(options: JobOptions) -> int:
    """Returns how many iterations a job may take, as far as the client can tell."""
    iterations = options.get("iterations")
    if iterations is not None:
        return max(iterations, 0)
    return (to_method(options) or Optimize())._iterations


def encode_options(options: JobOptions) -> pb.SmoothingOptions:
    """Returns the options of a job as they travel."""
    message = pb.SmoothingOptions()
    method = to_method(options)
    if method is not None:
        _encode_method(method, message)
    if options.get("reference") is not None:
        _aim_at_reference(method, message)
    elif isinstance(method, Optimize) and method.target == "reference":
        raise misplaced("reference", 'target="reference" needs reference=…')
    for field, name in (
        ("iterations", "max_iteration_count"),
        ("tolerance", "convergence_tolerance"),
        ("absolute_tolerance", "absolute_tolerance"),
        ("feature_angle", "feature_angle_degrees"),
        ("guard", "guard"),
        ("never_worse", "never_worse"),
        ("target_quality", "target_quality"),
        ("only_below", "only_below"),
        ("only_below_rings", "only_below_rings"),
        ("report_below", "report_below"),
    ):
        if (value := options.get(field)) is not None:
            _set(message, name, field, value)
    for field, name in (
        ("boundary", "boundary_policy"),
        ("form", "form"),
        ("tangled", "tangled_policy"),
        ("metric", "metric"),
    ):
        if (value := options.get(field)) is not None:
            setattr(message, name, to_choice(field, value))
    _encode_movement_limit(options.get("movement_limit"), message)
    if (budget := options.get("compute_budget")) is not None:
        message.compute_budget.CopyFrom(to_duration("compute_budget", budget))
    return message


def _encode_method(method: Method, message: pb.SmoothingOptions) -> None:
    own = getattr(message, method._name)
    own.SetInParent()
    for field in fields(method):
        value = getattr(method, field.name)
        if value is None:
            continue
        if field.name in _CHOICES:
            value = to_choice(field.name, value)
        _set(own, _WIRE_NAMES.get(field.name, field.name), field.name, value)


def _set(message: Any, name: str, field: str, value: Any) -> None:
    try:
        setattr(message, name, value)
    except (TypeError, ValueError):
        raise out_of_range(field, f"{field} is {value!r}, which is no such number") from None


def _aim_at_reference(method: Method | None, message: pb.SmoothingOptions) -> None:
    if not isinstance(method, Optimize | None) or (
        method is not None and method.target in ("ideal", "input")
    ):
        raise misplaced(
            "reference", 'reference belongs to method="optimize" with target="reference"'
        )
    message.optimize.target = pb.TARGET_REFERENCE


def _encode_movement_limit(limit: float | str | None, message: pb.SmoothingOptions) -> None:
    if limit is None:
        return
    try:
        if isinstance(limit, str) and limit.rstrip().endswith("%"):
            message.movement_limit = float(limit.rstrip()[:-1]) / 100
        else:
            message.absolute_movement_limit = float(limit)
    except ValueError:
        raise out_of_range(
            "movement_limit",
            f"movement_limit {limit!r} is neither a length (0.5) nor a share of the diagonal "
            '("2%")',
        ) from None
