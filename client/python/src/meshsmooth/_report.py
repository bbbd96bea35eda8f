"""Summaries as text of one screen, like the command line's."""

from __future__ import annotations

from ._fit import Fit
from ._reported import to_text
from ._summary import MetricStats, Motion, PoorElements, QualityStats, Summary

_BARS = " ▁▂▃▄▅▆▇█"
ROWS = (
    ("mean_ratio", (("min", "min"), ("percentile_1", "1 %"), ("mean", "mean"))),
    ("scaled_jacobian", (("min", "min"), ("percentile_1", "1 %"), ("mean", "mean"))),
    ("radius_ratio", (("min", "min"), ("percentile_1", "1 %"), ("mean", "mean"))),
    ("min_dihedral_angle", (("min", "min"),)),
    ("max_dihedral_angle", (("max", "max"),)),
    ("min_angle", (("min", "min"),)),
    ("max_angle", (("max", "max"),)),
)


def label_of(metric: str) -> str:
    """Returns a metric's name in words."""
    return metric.replace("_", " ")


def digits_of(metric: str) -> int:
    """Returns how many decimals a metric is shown with."""
    return 2 if metric.endswith("angle") else 4


def counted(count: int, noun: str) -> str:
    """Returns "1,234 nodes"."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def seconds_text(seconds: float) -> str:
    """Returns "1.5 ms" or "2 min 05 s"."""
    if seconds < 0.0009995:
        return f"{seconds * 1e6:.0f} us"
    if seconds < 0.9995:
        return f"{seconds * 1e3:.3g} ms"
    if seconds < 99.95:
        return f"{seconds:.3g} s"
    whole = int(seconds + 0.5)
    return f"{whole // 60} min {whole % 60:02} s"


def draw_histogram(bins: tuple[int, ...]) -> str:
    """Returns a bar of eight heights for each bin; what is not empty is visible."""
    highest = max(bins, default=0)
    return "".join(
        _BARS[max(1, (count * 8 + highest // 2) // highest)] if count else _BARS[0]
        for count in bins
    )


def headline(summary: Summary) -> str:
    """Returns how far the mesh moved, if it was to, and why the job ended."""
    stop = stop_sentence(summary)
    return stop if summary.motion is None else f"{_motion_sentence(summary.motion)}; {stop}"


def _motion_sentence(motion: Motion) -> str:
    text = f"reached {100 * motion.reached:.4g} % of the motion "
    text += f"in {counted(motion.step_count, 'step')}"
    if not motion.blocking_elements:
        return text
    inverted = counted(motion.blocking_element_count, "inverted element")
    return f"{text} (a step further: {inverted}, {', '.join(map(str, motion.blocking_elements))})"


def fit_sentences(fit: Fit) -> list[str]:
    """Returns how far the boundary came onto a target surface."""
    far, back = fit.result_to_surface, fit.surface_to_result
    found = [
        f"{fit.reached_count:,} of {counted(fit.node_count, 'boundary node')} lie on the surface",
        f"distance from the surface: largest {far.largest:.3g}, mean {far.mean:.3g}; "
        f"of the surface from the boundary: largest {back.largest:.3g}, mean {back.mean:.3g}",
    ]
    named = {
        "held off it: elements would not stay valid": (fit.held_count, "node"),
        "of the surface without a node": (fit.unmatched_corner_count, "corner"),
        "of the surface without a path of edges": (fit.unmatched_curve_count, "curve"),
        "of the surface open": (fit.surface.open_edge_count, "edge"),
        "of the surface of more than two triangles": (fit.surface.non_manifold_edge_count, "edge"),
        "of the surface without an area": (fit.surface.degenerate_triangle_count, "triangle"),
    }
    found += [f"{counted(n, noun)} {what}" for what, (n, noun) in named.items() if n]
    return found


def stop_sentence(summary: Summary) -> str:
    """Returns why the job ended."""
    convergence = summary.convergence
    after = f"after {counted(convergence.iteration_count, 'iteration')}"
    move = f"largest move {convergence.last_max_displacement:.3g}"
    if convergence.tolerance:
        move += f", tolerance {convergence.tolerance:.3g}"
    if summary.stop_reason == "iteration_limit" and convergence.iteration_count == 0:
        return "evaluated only: no iteration was allowed"
    return {
        "converged": f"converged {after} ({move})",
        "target_reached": f"reached the target quality {after}",
        "iteration_limit": f"stopped {after} at the limit, not converged ({move})",
        "compute_budget": f"stopped {after} when the compute budget was used up ({move})",
        "stagnated": f"stagnated {after}: no node moves any more for the better ({move})",
        "cancelled_with_result": f"cancelled {after}; this is the result reached by then ({move})",
    }.get(summary.stop_reason, f"{summary.stop_reason} {after}")


def _inverted_sentence(summary: Summary) -> str:
    before = summary.quality_before.inverted_element_count
    after = summary.quality_after.inverted_element_count
    was = "was" if before == 1 else "were"
    if after == 0:
        if before == 0:
            return "no element is inverted"
        return f"no element is inverted any more; {before:,} {was} before"
    total = counted(summary.quality_after.element_count, "element")
    text = f"{after:,} of {total} {'is' if after == 1 else 'are'} inverted"
    return f"{text}; {before:,} {was} before" if before else f"{text}; they were valid before"


def _reading_lines(stats: QualityStats) -> list[str]:
    """How elements were read that are not written as others are; nothing where none are."""
    lines = []
    if count := stats.mirrored_element_count:
        are, they = ("is", "it was") if count == 1 else ("are", "they were")
        ids = ", ".join(map(str, stats.mirrored_elements))
        more = " …" if count > len(stats.mirrored_elements) else ""
        lines.append(
            f"{counted(count, 'element')} {are} numbered the other way round and read as if {they} "
            f"not: {ids}{more}"
        )
    if count := stats.collapsed_element_count:
        lines.append(
            f"{counted(count, 'element')} with repeated nodes: read as the type that the nodes form"
        )
    if count := stats.interface_element_count:
        lines.append(
            f"{counted(count, 'interface element')} without thickness: not evaluated, their nodes "
            "stay"
        )
    return lines


def _kept_sentences(summary: Summary) -> list[str]:
    """Which nodes went back so that nothing became worse, and what did; nothing for neither."""
    found = []
    if (kept := summary.kept_quality) is not None:
        reasons = {
            "the least mean ratio": kept.for_mean_ratio,
            "the least scaled jacobian": kept.for_scaled_jacobian,
            f"the mean {label_of(kept.metric)}": kept.for_mean,
        }
        if count := sum(reasons.values()):
            texts = [f"{what} ({nodes:,})" for what, nodes in reasons.items() if nodes]
            nodes = counted(count, "node")
            found.append(f"{nodes} went back, so that these did not fall: {', '.join(texts)}")
    if lower := summary.lower_measures():
        texts = [f"{what} {after:.4f}, was {before:.4f}" for what, before, after in lower]
        found.append(f"worse than before: {'; '.join(texts)}")
    return found


def _poor_sentence(poor: PoorElements) -> str:
    rest = poor.element_count - poor.locked_count - poor.limited_count
    return (
        f"{counted(poor.element_count, 'element')} below a mean ratio of {poor.below:.4g}: "
        f"{poor.locked_count:,} locked, {poor.limited_count:,} limited by connectivity, "
        f"{rest:,} could still become better"
    )


def _locked_sentence(summary: Summary) -> str:
    locked = summary.locked
    are, them = ("is", "it") if locked.element_count == 1 else ("are", "them")
    text = (
        f"{counted(locked.element_count, 'element')} {are} locked: all nodes fixed, no smoothing "
        f"can repair {them}"
    )
    if locked.inverted_element_count:
        text += f"; {locked.inverted_element_count:,} of them inverted"
    if locked.worst_element is not None:
        worst = locked.worst_element
        text += f"; the worst, element {worst.element}, has mean ratio {worst.mean_ratio:.4f}"
    return text


def _nodes_sentence(summary: Summary) -> str:
    nodes = summary.nodes
    text = (
        f"{counted(nodes.total, 'node')}: {nodes.moved:,} moved, {nodes.fixed:,} fixed "
        f"({nodes.boundary:,} on the boundary)"
    )
    sliding = (
        nodes.sliding_in_plane
        + nodes.sliding_on_line
        + nodes.sliding_on_surface
        + nodes.sliding_on_curve
    )
    if sliding:
        text += f", {sliding:,} slide"
    if nodes.coincident:
        text += f", {nodes.coincident:,} on the boundary share their positions and stay"
    if nodes.paired:
        text += f", {nodes.paired:,} in pairs stay"
    if nodes.on_non_manifold_edges:
        text += f", {nodes.on_non_manifold_edges:,} on non-manifold edges"
    if nodes.isolated:
        text += f", {nodes.isolated:,} in no element"
    return text


def sentences(summary: Summary) -> list[str]:
    """Returns what there is to say beside the table."""
    found = [_inverted_sentence(summary)]
    if degenerate := summary.quality_after.degenerate_element_count:
        are = "is" if degenerate == 1 else "are"
        found.append(f"{counted(degenerate, 'element')} {are} degenerate")
    found.extend(_kept_sentences(summary))
    if summary.fit is not None:
        found.extend(fit_sentences(summary.fit))
    if summary.locked.element_count:
        found.append(_locked_sentence(summary))
    if 0 < summary.quality_after.element_count == summary.locked.element_count:
        found.append(
            "no node can move: all are fixed; are there coincident nodes (merge_coincident=True), "
            'or may the boundary move (boundary="slide")?'
        )
    if summary.poor is not None:
        found.append(_poor_sentence(summary.poor))
    found.append(_nodes_sentence(summary))
    times = summary.timings
    stages = [
        (name.replace("find_", ""), getattr(times, name))
        for name in times.__dataclass_fields__
        if getattr(times, name) > 0
    ]
    execution = summary.execution
    where = execution.device_name or execution.backend_kind
    if stages:
        text = ", ".join(f"{name} {seconds_text(seconds)}" for name, seconds in stages)
        found.append(f"time on the server: {text}{f' ({where})' if where else ''}")
    return found


def table(summary: Summary) -> list[tuple[str, str, str, str]]:
    """Returns rows of metric, statistic, before and after."""
    rows = []
    for name, statistics in ROWS:
        before = summary.quality_before.find_metric(name)
        after = summary.quality_after.find_metric(name)
        if before is None or after is None:
            continue
        digits = digits_of(name)
        for field, label in statistics:
            values = [f"{getattr(stats, field):.{digits}f}" for stats in (before, after)]
            rows.append((label_of(name), label, *values))
    return rows  # type: ignore[return-value]


@to_text.register
def describe(summary: Summary) -> str:
    """Returns a summary as text."""
    lines = [headline(summary)]
    if rows := table(summary):
        lines.append(f"  {'quality':<24} {'before':>10} {'after':>10}")
        last = ""
        for metric, statistic, before, after in rows:
            label = f"{metric if metric != last else '':<19}{statistic}"
            lines.append(f"  {label:<24} {before:>10} {after:>10}")
            last = metric
    for label, stats in (
        ("mean ratio before", summary.quality_before.find_metric("mean_ratio")),
        ("           after", summary.quality_after.find_metric("mean_ratio")),
    ):
        if stats is not None:
            lines.append(f"  {label:<24} {_histogram_line(stats)}")
    return "\n".join(lines + sentences(summary))


def _histogram_line(stats: MetricStats) -> str:
    return (
        f"{stats.histogram_lower:g} |{draw_histogram(stats.histogram)}| {stats.histogram_upper:g}"
    )


@to_text.register
def describe_quality(stats: QualityStats) -> str:
    """Returns a quality report as text."""
    head = counted(stats.element_count, "element")
    lines = [f"{head:<19} {'min':>9} {'1 %':>9} {'mean':>9} {'max':>9}"]
    for metric in stats.metrics:
        if not metric.element_count:
            continue
        values = (metric.min, metric.percentile_1, metric.mean, metric.max)
        digits = digits_of(metric.metric)
        numbers = " ".join(f"{value:>9.{digits}f}" for value in values)
        lines.append(f"{label_of(metric.metric):<19} {numbers}  {_histogram_line(metric)}")
    lines.append(
        f"inverted {stats.inverted_element_count:,}, degenerate {stats.degenerate_element_count:,}"
    )
    lines.extend(_reading_lines(stats))
    for worst in stats.worst_elements:
        lines.append(
            f"worst {worst.element:>12} {worst.element_type:<12} mean ratio "
            f"{worst.mean_ratio:.4f}, scaled jacobian {worst.scaled_jacobian:.4f}"
        )
    return "\n".join(lines)
