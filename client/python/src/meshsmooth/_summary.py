"""The report on a job, as frozen dataclasses; fields are those of meshsmooth.v1.Summary.

Times are in seconds, lengths in the mesh's unit. Elements have the caller's numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ._fit import Fit
from ._reported import Reported


@dataclass(frozen=True)
class Convergence:
    """How the sweeps ended; the lists have a value per iteration, with `history=True`."""

    iteration_count: int = 0
    last_max_displacement: float = 0.0
    last_rms_displacement: float = 0.0
    tolerance: float = 0.0
    bounding_box_diagonal: float = 0.0
    held_node_count: int = 0
    max_displacements: tuple[float, ...] = ()
    rms_displacements: tuple[float, ...] = ()
    moved_node_counts: tuple[int, ...] = ()
    energies: tuple[float, ...] = ()
    worst_mean_ratios: tuple[float, ...] = ()
    end_rule: str = ""  # by which the job converged or stagnated
    remaining_gain: float | None = None  # optimize: share of the energy, estimated


@dataclass(frozen=True)
class MetricStats:
    """The values of one metric over all elements that have it; `histogram` has equal bins."""

    metric: str = ""
    element_count: int = 0
    min: float = 0.0
    percentile_1: float = 0.0
    mean: float = 0.0
    max: float = 0.0
    histogram_lower: float = 0.0
    histogram_upper: float = 0.0
    histogram: tuple[int, ...] = ()


@dataclass(frozen=True)
class ElementQuality:
    """The quality of one element."""

    element: int = 0
    element_type: str = ""
    mean_ratio: float = 0.0
    scaled_jacobian: float = 0.0


@dataclass(frozen=True, repr=False)
class QualityStats(Reported):
    """The quality of a mesh."""

    element_count: int = 0
    inverted_element_count: int = 0
    degenerate_element_count: int = 0
    metrics: tuple[MetricStats, ...] = ()
    worst_elements: tuple[ElementQuality, ...] = ()
    sum_absolute_volume: float = 0.0
    enclosed_volume: float = 0.0
    mirrored_element_count: int = 0
    mirrored_elements: tuple[int, ...] = ()
    collapsed_element_count: int = 0
    interface_element_count: int = 0

    def metric(self, name: str) -> MetricStats:
        """Returns the values of a metric.

        Raises:
            KeyError: no element has it, or `quality="brief"` left it out.
        """
        stats = self.find_metric(name)
        if stats is None:
            known = ", ".join(m.metric for m in self.metrics if m.element_count)
            raise KeyError(f"no element has {name!r}; known are {known or 'none'}")
        return stats

    def find_metric(self, name: str) -> MetricStats | None:
        """Returns the values of a metric; None if no element has it or it was left out."""
        return next((m for m in self.metrics if m.metric == name and m.element_count), None)

    def histogram(self, name: str) -> tuple[tuple[float, ...], tuple[int, ...]]:
        """Returns edges and counts of the bins of a metric.

        Raises:
            KeyError: no element has this metric.
        """
        stats = self.metric(name)
        count = len(stats.histogram)
        step = (stats.histogram_upper - stats.histogram_lower) / max(count, 1)
        edges = tuple(stats.histogram_lower + i * step for i in range(count + 1))
        return edges, stats.histogram

    def __repr__(self) -> str:
        counts = f"{self.element_count:,} elements, {self.inverted_element_count:,} inverted"
        return f"<meshsmooth.QualityStats: {counts}>"


@dataclass(frozen=True)
class Locked:
    """Elements whose nodes are all fixed: no smoothing can repair them."""

    element_count: int = 0
    inverted_element_count: int = 0
    worst_element: ElementQuality | None = None


@dataclass(frozen=True)
class NodeCounts:
    """How many nodes did what."""

    total: int = 0
    boundary: int = 0
    fixed: int = 0
    isolated: int = 0
    moved: int = 0
    between_regions: int = 0
    sliding_in_plane: int = 0
    sliding_on_line: int = 0
    curved: int = 0
    sliding_on_surface: int = 0
    sliding_on_curve: int = 0
    outside_only_below: int = 0
    coincident: int = 0
    paired: int = 0
    on_non_manifold_edges: int = 0


@dataclass(frozen=True)
class BoundaryDeviation:
    """The one-sided deviations (Hausdorff) of curved parts that nodes slid on."""

    tolerance: float = 0.0
    result_to_input: float = 0.0
    input_to_result: float = 0.0


@dataclass(frozen=True)
class Timings:
    """Seconds in each stage of the job."""

    receive: float = 0.0
    queue: float = 0.0
    upload: float = 0.0
    find_neighbours: float = 0.0
    find_boundary: float = 0.0
    iterate: float = 0.0
    evaluate: float = 0.0
    download: float = 0.0
    send: float = 0.0


@dataclass(frozen=True)
class Execution:
    """Where the job ran."""

    backend_kind: str = ""
    device_name: str = ""
    device_index: int = 0
    host_peak_bytes: int = 0
    device_peak_bytes: int = 0
    topology_reused: bool = False
    thread_count: int = 0
    colour_count: int = 0
    server_version: str = ""


@dataclass(frozen=True)
class PoorElements:
    """The elements of the result below `report_below`, by what holds them there."""

    below: float = 0.0
    element_count: int = 0
    locked_count: int = 0
    limited_count: int = 0  # by connectivity: no allowed move of a node makes its ball better


@dataclass(frozen=True)
class Motion:
    """How far `move` came.

    Attributes:
        reached: share of the motion that the result has, [0, 1]. Below 1 a prescribed node lies at
            reference + reached * (prescribed - reference).
        step_count: steps that led to a valid mesh; one unless the motion is hard.
        blocking_element_count: elements that were inverted in the shortest rejected step.
        blocking_elements: the first of them.
    """

    reached: float = 0.0
    step_count: int = 0
    rejected_step_count: int = 0
    linear_iteration_count: int = 0  # of the conjugate gradients
    linear_residual: float = 0.0  # relative, at their end
    linear_time: float = 0.0
    blocking_element_count: int = 0
    blocking_elements: tuple[int, ...] = ()


@dataclass(frozen=True)
class KeptQuality:
    """Nodes that went back to where they were, by what would have been lower than in the input."""

    metric: str = ""  # in force
    for_mean_ratio: int = 0  # the least one
    for_scaled_jacobian: int = 0
    for_mean: int = 0  # of the metric in force


@dataclass(frozen=True, repr=False)
class Summary(Reported):
    """The report on a job."""

    stop_reason: str = ""
    convergence: Convergence = field(default_factory=Convergence)
    quality_before: QualityStats = field(default_factory=QualityStats)
    quality_after: QualityStats = field(default_factory=QualityStats)
    locked: Locked = field(default_factory=Locked)
    nodes: NodeCounts = field(default_factory=NodeCounts)
    timings: Timings = field(default_factory=Timings)
    execution: Execution = field(default_factory=Execution)
    options: dict[str, Any] = field(default_factory=dict)  # that the job ran with
    boundary_deviation: BoundaryDeviation | None = None
    flat_reference_element_count: int = 0
    poor: PoorElements | None = None
    motion: Motion | None = None  # of move
    kept_quality: KeptQuality | None = None  # with never_worse
    fit: Fit | None = None  # with surface

    def lower_measures(self) -> list[tuple[str, float, float]]:
        """Returns what is worse than in the input: its name, before and after.

        That are least mean ratios and scaled Jacobians that are lower by more than 1e-6, and the
        mean of the metric in force where it is lower by more than 0.1 %; nothing of `move`.
        """
        lower: list[tuple[str, float, float]] = []
        if self.motion is not None:
            return lower
        for metric in ("mean_ratio", "scaled_jacobian"):
            before = self.quality_before.find_metric(metric)
            after = self.quality_after.find_metric(metric)
            if before is None or after is None:
                continue
            name = metric.replace("_", " ")
            if after.min < before.min - 1e-6:
                lower.append((f"least {name}", before.min, after.min))
            in_force = self.kept_quality is None or self.kept_quality.metric == metric
            if in_force and after.mean < before.mean - 0.001 * abs(before.mean):
                lower.append((f"mean {name}", before.mean, after.mean))
        return lower

    def to_pandas(self) -> Any:
        """Returns a DataFrame of one row per metric, with its values before and after.

        Raises:
            ModuleNotFoundError: pandas is not installed.
        """
        import pandas

        rows = {}
        for before in self.quality_before.metrics:
            after = self.quality_after.find_metric(before.metric)
            if not before.element_count or after is None:
                continue
            rows[before.metric] = {
                (when, name): getattr(stats, name)
                for when, stats in (("before", before), ("after", after))
                for name in ("min", "percentile_1", "mean", "max")
            }
        return pandas.DataFrame.from_dict(rows, orient="index")

    def __repr__(self) -> str:
        return f"<meshsmooth.Summary: {self.stop_reason}; {self.quality_after!r} after>"
