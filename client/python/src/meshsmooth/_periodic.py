"""Pairs of nodes that belong together: given as such, or found on two periodic sides.

As the command line finds them (client/formats/node_pairs.cpp).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import InvalidOption
from ._job_options import JobOptions
from ._mesh import Mesh, chosen_nodes

Points = NDArray[np.float64]
_TOLERANCE = 1e-5  # of the diagonal of the larger side's bounding box
_MOST_ROTATIONS = 20000  # that are tried: of a sphere all nodes are as far from the centre


def node_pairs(mesh: Mesh, options: JobOptions) -> NDArray[np.int32] | None:
    """Returns pairs of nodes, [pairs, 2], or None without any.

    Args:
        mesh: the mesh; pairs of its own are among them, unless `file_pairs` is False.
        options: `periodic` is integers [pairs, 2]; or two sides, or a list of two sides each, each
            side as `chosen_nodes` takes it.

    Raises:
        InvalidOption: OPTION_OUT_OF_RANGE for a node that is not in the mesh; PERIODIC_MISMATCH
            where no translation or rotation takes one side to the other; NAME_UNKNOWN.
    """
    own = mesh.data.node_pairs if options.get("file_pairs", True) else None
    periodic = options.get("periodic")
    given = np.zeros((0, 2), np.int64) if periodic is None else _given_pairs(mesh, periodic)
    if own is not None:
        given = np.unique(np.concatenate([given, own]), axis=0)
    outside = (given < 0) | (given >= mesh.node_count)
    if outside.any():
        pair = int(np.flatnonzero(outside.any(axis=1))[0])
        raise _error(
            "OPTION_OUT_OF_RANGE",
            f"periodic: pair {pair} has node {given[outside][0]}, the mesh has "
            f"{mesh.node_count} nodes",
        )
    return np.ascontiguousarray(given, np.dtype("<i4")) if len(given) else None


def _given_pairs(mesh: Mesh, periodic: Any) -> NDArray[Any]:
    pairs = _as_pairs(periodic)
    if pairs is not None:
        return pairs
    sides = [periodic] if len(periodic) == 2 and isinstance(periodic[0], str) else periodic
    found = [_match(mesh, *_two(pair)) for pair in sides]
    return np.concatenate(found) if found else np.zeros((0, 2), np.int64)


def _as_pairs(periodic: Any) -> NDArray[Any] | None:
    """The pairs as they are given; None: they are sides."""
    if isinstance(periodic, str):
        raise _error("OPTION_OUT_OF_RANGE", 'periodic takes two sides, as in ("left", "right")')
    try:
        array = np.asarray(periodic)
    except ValueError:  # sides of different lengths
        return None
    if array.size == 0:
        return np.zeros((0, 2), np.int64)
    if array.dtype.kind in "iu" and array.ndim == 2 and array.shape[1] == 2:
        return array
    if isinstance(periodic, np.ndarray):
        raise _error(
            "OPTION_OUT_OF_RANGE",
            f"periodic has the shape {array.shape}, pairs of nodes need integers of (pairs, 2)",
        )
    return None


def _two(pair: Any) -> tuple[Any, Any]:
    if isinstance(pair, str) or not hasattr(pair, "__len__") or len(pair) != 2:
        raise _error("OPTION_OUT_OF_RANGE", f"periodic has {pair!r} where two sides are needed")
    return pair[0], pair[1]


def _match(mesh: Mesh, side_a: Any, side_b: Any) -> NDArray[np.int64]:
    """Returns the pairs of two sides; a node of both, as on the axis, is its own partner."""
    sides = [np.unique(_nodes_of(mesh, side)) for side in (side_a, side_b)]
    names = [f'"{side}"' if isinstance(side, str) else "a side" for side in (side_a, side_b)]
    if len(sides[0]) != len(sides[1]) or len(sides[0]) == 0:
        raise _error(
            "PERIODIC_MISMATCH",
            f"{names[0]} has {len(sides[0])} nodes, {names[1]} has {len(sides[1])}; periodic sides "
            "need the same number, at least 1",
        )
    a, b = (mesh.points[side].astype(np.float64) for side in sides)
    tolerance = _TOLERANCE * max(float(np.linalg.norm(np.ptp(side, axis=0))) for side in (a, b))
    centred_a, centred_b = a - a.mean(axis=0), b - b.mean(axis=0)
    partners = _partners(centred_a, centred_b, tolerance)
    if partners is None:
        shift = b.mean(axis=0) - a.mean(axis=0)
        for rotation in _rotations(centred_a, centred_b, shift, tolerance):
            partners = _partners(centred_a @ rotation.T, centred_b, tolerance)
            if partners is not None:
                break
    if partners is None:
        worst, distance = _farthest(centred_a, centred_b)
        raise _error(
            "PERIODIC_MISMATCH",
            f"no translation or rotation takes {names[0]} to {names[1]}: translated, node "
            f"{mesh.caller_node(int(sides[0][worst]))} is {distance:.4g} away from the nearest "
            f"node there, the tolerance is {tolerance:.4g}; the two sides need the same nodes",
        )
    return np.stack([sides[0], sides[1][partners]], axis=1).astype(np.int64)


def _nodes_of(mesh: Mesh, side: Any) -> NDArray[np.int64]:
    nodes = chosen_nodes(mesh, side, "periodic").astype(np.int64)
    outside = (nodes < 0) | (nodes >= mesh.node_count)
    if outside.any():
        raise _error(
            "OPTION_OUT_OF_RANGE",
            f"periodic: node {nodes[outside][0]} is not in the mesh, which has {mesh.node_count}",
        )
    return nodes


def _partners(a: Points, b: Points, tolerance: float) -> NDArray[np.int64] | None:
    """Returns the index in b of each point of a; None where one has none."""
    axis = int(np.argmax(np.ptp(b, axis=0)))
    order = np.argsort(b[:, axis], kind="stable")
    along = b[order, axis]
    first = np.searchsorted(along, a[:, axis] - tolerance)
    last = np.searchsorted(along, a[:, axis] + tolerance, side="right")
    best = np.full(len(a), np.inf)
    partner = np.zeros(len(a), np.int64)
    # Those that come first in all windows, then the second ones: windows are short.
    for step in range(int((last - first).max(initial=0))):
        rows = np.flatnonzero(first + step < last)
        found = order[first[rows] + step]
        distance = np.linalg.norm(a[rows] - b[found], axis=1)
        nearer = distance < best[rows]
        best[rows[nearer]] = distance[nearer]
        partner[rows[nearer]] = found[nearer]
    if (best > tolerance).any() or len(np.unique(partner)) < len(partner):
        return None
    return partner


def _rotations(a: Points, b: Points, shift: Points, tolerance: float) -> Iterator[Points]:
    """Yields rotations that take three points of a to such of b.

    Those without a part along their axis come first, then the smaller angle.
    """
    first = a[np.argmax(np.linalg.norm(a, axis=1))]
    length = float(np.linalg.norm(first))
    if length == 0:
        return
    away = np.linalg.norm(np.cross(a, first), axis=1) / length
    second = a[np.argmax(away)]
    near = 4 * tolerance
    lengths = np.linalg.norm(b, axis=1)
    firsts = b[np.abs(lengths - length) <= near]
    found: list[Points] = []
    if away.max() <= 10 * tolerance:  # on a line, which does not fix the rotation about itself
        for end in firsts:
            axis = np.cross(first, end)
            if np.linalg.norm(axis) <= near * length:
                axis = np.cross(end, np.eye(3)[np.argmin(np.abs(end))])
            found.append(_between(first, axis, end, axis))
    else:
        ends = b[np.abs(lengths - np.linalg.norm(second)) <= near]
        for end in firsts:
            apart = np.linalg.norm(ends - end, axis=1) - np.linalg.norm(second - first)
            found += [_between(first, second, end, other) for other in ends[np.abs(apart) <= near]]
            if len(found) >= _MOST_ROTATIONS:
                break
    yield from sorted(found, key=lambda rotation: _order(rotation, shift, tolerance))


def _basis(first: Points, second: Points) -> Points:
    u = first / np.linalg.norm(first)
    v = second - (second @ u) * u
    v = v / np.linalg.norm(v)
    return np.stack([u, v, np.cross(u, v)])


def _between(first: Points, second: Points, to_first: Points, to_second: Points) -> Points:
    rotation: Points = _basis(to_first, to_second).T @ _basis(first, second)
    return rotation


def _order(rotation: Points, shift: Points, tolerance: float) -> tuple[float, float]:
    angle = float(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))
    antisymmetric = rotation - rotation.T
    axis = np.array([antisymmetric[2, 1], antisymmetric[0, 2], antisymmetric[1, 0]])
    if np.linalg.norm(axis) < 1e-6:  # at half a turn the axis stands in R + 1
        rows = rotation + np.eye(3)
        axis = rows[np.argmax(np.linalg.norm(rows, axis=1))]
    size = float(np.linalg.norm(axis))
    along = abs(float(axis @ shift)) / size if size else 0.0
    return (along if along > 10 * tolerance else 0.0, angle)


def _farthest(a: Points, b: Points) -> tuple[int, float]:
    """Returns the point of a that is farthest from those of b, and how far."""
    worst, distance = 0, -1.0
    for at in range(0, len(a), 256):
        nearest = np.linalg.norm(a[at : at + 256, None] - b, axis=2).min(axis=1)
        if nearest.max() > distance:
            worst, distance = at + int(nearest.argmax()), float(nearest.max())
    return worst, distance


def _error(reason: str, what: str) -> InvalidOption:
    return InvalidOption(what, reason=reason, details={"field": "periodic"})
