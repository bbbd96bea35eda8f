"""Cells in the layouts that Python's mesh packages use, to blocks of elements.

Cells are numbered from 0 in the caller's order, through all blocks. The cells of the highest
dimension are the mesh's elements, one block for each type in the order of appearance; the others
only hold their nodes (`Cells.lower_dimensional`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._cell_layouts import Run, read_runs
from ._errors import InvalidMesh

IntArray = NDArray[Any]


@dataclass(frozen=True)
class Block:
    """Elements of one type, as they travel."""

    element_type: int
    nodes: IntArray  # [elements, nodes of the type], C order; int32, or int64 that fit

    @property
    def element_count(self) -> int:
        """How many there are."""
        return len(self.nodes)


@dataclass(frozen=True)
class Cells:
    """All cells of a mesh."""

    cell_count: int
    blocks: list[Block]
    element_cells: NDArray[np.int64] | None  # the cell of each element; None: its own number
    lower_dimensional: list[Run]  # the other cells

    @property
    def element_count(self) -> int:
        """How many cells are elements."""
        return sum(block.element_count for block in self.blocks)


def parse_cells(cells: Any) -> Cells:
    """Reads cells in any layout of docs/python.md ("Cells").

    Raises:
        InvalidMesh: ELEMENT_NOT_SUPPORTED for types other than triangles, quads, tetrahedra,
            pyramids, wedges and hexahedra of first and second order, vertices and lines;
            MESH_EMPTY; INDEX_OUT_OF_RANGE for a node that is no 32-bit integer;
            ARRAY_SIZE_MISMATCH for arrays that do not fit each other.
    """
    runs = list(read_runs(cells))
    runs = [run for run in runs if len(run.nodes)]
    highest = max((run.kind.dimension for run in runs), default=0)
    if highest < 2:
        raise InvalidMesh(
            "the mesh has no surface or volume elements",
            reason="MESH_EMPTY",
            details={"field": "element_blocks"},
        )
    elements: dict[int, list[Run]] = {}
    lower = []
    for run in runs:
        if run.kind.dimension < highest:
            lower.append(run)
        else:
            elements.setdefault(run.kind.element, []).append(run)
    blocks = [
        Block(element_type, np.concatenate([_as_node_ids(run) for run in same]))
        if len(same) > 1
        else Block(element_type, _as_node_ids(same[0]))
        for element_type, same in elements.items()
    ]
    ordered = [run for same in elements.values() for run in same]
    count = sum(len(run.nodes) for run in runs)
    return Cells(count, blocks, _element_cells(ordered), lower)


def _element_cells(runs: list[Run]) -> NDArray[np.int64] | None:
    first = 0
    for run in runs:
        if not isinstance(run.ids, range) or run.ids.start != first:
            break
        first += len(run.nodes)
    else:
        return None
    return np.concatenate([np.asarray(run.ids, np.int64) for run in runs])


def _as_node_ids(run: Run) -> IntArray:
    nodes = run.nodes
    if nodes.dtype.kind not in "iu":
        raise InvalidMesh(
            f"the nodes of the cells of type {run.kind.name} are of the type {nodes.dtype}, they "
            "must be integers",
            reason="ARRAY_SIZE_MISMATCH",
        )
    if nodes.dtype.itemsize > 4 or nodes.dtype == np.uint32:
        limits = np.iinfo(np.int32)
        if nodes.max() > limits.max or nodes.min() < limits.min:
            row = int(np.flatnonzero(((nodes > limits.max) | (nodes < limits.min)).any(axis=1))[0])
            error = InvalidMesh(
                f"element {run.ids[row]}: node {nodes[row].max()} is out of range, nodes are "
                "32-bit integers",
                reason="INDEX_OUT_OF_RANGE",
            )
            error.element, error.node = int(run.ids[row]), int(nodes[row].max())
            raise error
        if nodes.dtype == np.dtype("<i8") and nodes.flags.c_contiguous:
            return nodes  # converted while it is sent
    return np.ascontiguousarray(nodes, np.dtype("<i4"))
