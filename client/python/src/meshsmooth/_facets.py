"""The facets of elements: which are on the boundary, and which cells lie inside."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._cell_layouts import Run
from ._cells import Block

# The corners of each facet, by element type; as in core/src/mesh/element.cpp.
_FACETS: dict[int, tuple[tuple[int, ...], ...]] = {
    1: ((0, 1), (1, 2), (2, 0)),
    2: ((0, 1), (1, 2), (2, 3), (3, 0)),
    3: ((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)),
    4: ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    5: ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    6: (
        *((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4)),
        *((3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
    ),
}
# Second order: the linear type, and the corners in whose middle the other nodes lie.
_EDGES = {
    1: ((0, 1), (1, 2), (2, 0)),
    2: ((0, 1), (1, 2), (2, 3), (3, 0)),
    3: ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    4: ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
    5: ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    6: (
        *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6)),
        *((6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
    ),
}
_LINEAR = {7: 1, 8: 2, 9: 2, 10: 3, 11: 4, 12: 5, 13: 5, 14: 6, 15: 6}
_WITH_FACE_NODES = (13, 15)


def _facets_of(element_type: int) -> list[tuple[tuple[int, ...], list[int]]]:
    """Returns the corners of each facet, and its other nodes."""
    linear = _LINEAR.get(element_type)
    if linear is None:
        return [(facet, []) for facet in _FACETS[element_type]]
    corner_count = 1 + max(max(facet) for facet in _FACETS[linear])
    middles: list[tuple[int, ...]] = list(_EDGES[linear])
    if element_type in _WITH_FACE_NODES:
        middles += [facet for facet in _FACETS[linear] if len(facet) == 4]
    return [
        (facet, [corner_count + m for m, of in enumerate(middles) if set(of) <= set(facet)])
        for facet in _FACETS[linear]
    ]


class Facets(NamedTuple):
    """The facets of all elements, sorted, so that the same ones follow each other."""

    corners: NDArray[np.uint32]  # [facets, 4], ascending in a row; 0: none, others count from 1
    element: NDArray[np.int64]  # [facets]
    first: NDArray[np.bool_]  # [facets]: unlike the one before it
    order: NDArray[np.int64]  # the place of each among the facets of the blocks, one after another


def _find_facets(blocks: list[Block]) -> Facets:
    runs, elements = [], []
    first_element = 0
    for block in blocks:
        ids = np.arange(first_element, first_element + block.element_count)
        for corners, _ in _facets_of(block.element_type):
            runs.append(_rows(block.nodes[:, corners]))
            elements.append(ids)
        first_element += block.element_count
    rows = np.concatenate(runs)
    keys = rows.view(np.uint64)  # two to a facet: fewer to sort by
    order = np.lexsort(keys.T)
    rows = rows[order]
    is_new = (keys[order[1:]] != keys[order[:-1]]).any(axis=1)
    return Facets(rows, np.concatenate(elements)[order], np.append(True, is_new), order)


def _rows(corners: NDArray[np.integer]) -> NDArray[np.uint32]:
    rows = np.zeros((len(corners), 4), np.uint32)
    rows[:, : corners.shape[1]] = np.sort(corners, axis=1) + 1
    return rows


def boundary_nodes(
    blocks: list[Block], node_count: int, regions: NDArray[np.int32] | None = None
) -> NDArray[np.int64]:
    """Returns the nodes of the facets that only one element uses, ascending.

    With regions also those of facets between two of them. O(facets * log facets).
    """
    facets = _find_facets(blocks)
    chosen = facets.first & np.append(facets.first[1:], True)
    if regions is not None:
        region = regions[facets.element]
        between = ~facets.first[1:] & (region[1:] != region[:-1])
        chosen[1:] |= between
    found = [facets.corners[chosen].reshape(-1)]
    own = facets.order[chosen]  # among the facets of the blocks
    at = 0
    for block in blocks:
        for _, others in _facets_of(block.element_type):
            here = own[(own >= at) & (own < at + block.element_count)] - at
            if others:
                found.append(block.nodes[here][:, others].reshape(-1).astype(np.uint32) + 1)
            at += block.element_count
    nodes = np.unique(np.concatenate(found)).astype(np.int64)
    return nodes[(nodes > 0) & (nodes <= node_count)] - 1


def inner_nodes(
    blocks: list[Block],
    lower: list[Run],
    node_count: int,
    regions: NDArray[np.int32] | None,
) -> NDArray[np.int64]:
    """Returns the nodes of cells of lower dimension that lie inside a region, repeated or not.

    A surface of a volume mesh, or a line of a surface mesh, lies inside where two elements of one
    region share each of its cells; so does every cell with a node that is neither on the boundary
    nor between regions. As client/formats/inner_cells.cpp. O(facets * log facets).
    """
    outer = np.zeros(node_count, np.bool_)
    outer[boundary_nodes(blocks, node_count, regions)] = True
    facets = _find_facets(blocks)
    # The facets that two elements share, all of one region.
    shared = ~np.append(facets.first[1:], True) & facets.first
    if regions is not None:
        groups = np.cumsum(facets.first) - 1
        region = regions[facets.element]
        begin = np.flatnonzero(facets.first)
        mixed = np.zeros(len(begin), np.bool_)
        mixed[groups[region != region[begin][groups]]] = True
        shared[begin[mixed]] = False
    within = {row.tobytes() for row in facets.corners[shared & _on(facets.corners, outer)]}
    dimension = 3 if any(_LINEAR.get(b.element_type, b.element_type) > 2 for b in blocks) else 2
    found = [np.zeros(0, np.int64)]
    for run in lower:
        nodes = np.asarray(run.nodes).astype(np.int64)
        exists = ((nodes >= 0) & (nodes < node_count)).all(axis=1)
        nodes = nodes[exists]
        inside = ~outer[nodes].all(axis=1)
        if run.kind.dimension == dimension - 1 and within and (corner_count := _corners(run)):
            rows = _rows(nodes[:, :corner_count])
            inside |= np.fromiter((row.tobytes() in within for row in rows), np.bool_, len(rows))
        found.append(nodes[inside].reshape(-1))
    return np.concatenate(found)


def _on(corners: NDArray[np.uint32], outer: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether all corners are on the boundary: of other facets no cell is asked for."""
    marks = np.append(True, outer)  # 0 stands for no corner
    on: NDArray[np.bool_] = np.all(marks[np.minimum(corners, len(outer))], axis=1)
    return on


def _corners(run: Run) -> int:
    """The corners of a cell that may be a facet; 0: it is none."""
    if run.kind.dimension == 1:
        return 2 if run.kind.node_count else 0
    return {1: 3, 2: 4}.get(_LINEAR.get(run.kind.element, run.kind.element), 0)
