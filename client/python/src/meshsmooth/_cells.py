"""Cells in the layouts that Python's mesh packages use, to blocks of elements.

Cells are numbered from 0 in the caller's order, through all blocks. The cells of the highest
dimension are the mesh's elements, one block for each type in the order of appearance; the others
only hold their nodes (`Cells.lower_dimensional`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import InvalidMesh

IntArray = NDArray[Any]


class CellType(NamedTuple):
    """A type of cell that may be in a mesh."""

    name: str  # meshio's
    vtk: int
    dimension: int
    node_count: int  # 0: any
    element: int  # of meshsmooth.v1.ElementType; 0: not an element


_TYPES = (
    CellType("vertex", 1, 0, 1, 0),
    CellType("poly_vertex", 2, 0, 0, 0),
    CellType("line", 3, 1, 2, 0),
    CellType("poly_line", 4, 1, 0, 0),
    CellType("triangle", 5, 2, 3, 1),
    CellType("quad", 9, 2, 4, 2),
    CellType("tetra", 10, 3, 4, 3),
    CellType("pyramid", 14, 3, 5, 4),
    CellType("wedge", 13, 3, 6, 5),
    CellType("hexahedron", 12, 3, 8, 6),
    CellType("line3", 21, 1, 3, 0),
    CellType("triangle6", 22, 2, 6, 7),
    CellType("quad8", 23, 2, 8, 8),
    CellType("quad9", 28, 2, 9, 9),
    CellType("tetra10", 24, 3, 10, 10),
    CellType("pyramid13", 27, 3, 13, 11),
    CellType("wedge15", 26, 3, 15, 12),
    CellType("wedge18", 32, 3, 18, 13),
    CellType("hexahedron20", 25, 3, 20, 14),
    CellType("hexahedron27", 29, 3, 27, 15),
)
_BY_NAME = {kind.name: kind for kind in _TYPES}
_BY_NAME |= {
    "point": _BY_NAME["vertex"],
    "edge": _BY_NAME["line"],
    "tri": _BY_NAME["triangle"],
    "quadrilateral": _BY_NAME["quad"],
    "tet": _BY_NAME["tetra"],
    "tetrahedron": _BY_NAME["tetra"],
    "prism": _BY_NAME["wedge"],
    "hex": _BY_NAME["hexahedron"],
}
_BY_VTK = {kind.vtk: kind for kind in _TYPES}
DIMENSIONS = {kind.name: kind.dimension for kind in _TYPES}
ELEMENT_TO_VTK = {kind.element: kind.vtk for kind in _TYPES if kind.element}
_POLYGON = 7
_SIZES = np.full(256, -1, np.int64)  # nodes of a VTK type; 0: any, -1: not known
for _kind in _TYPES:
    _SIZES[_kind.vtk] = _kind.node_count
_SIZES[_POLYGON] = 0

# VTK lets the normal of a wedge's first triangle point out of the wedge, gmsh into it; the nodes in
# the middle of edges and faces follow in VTK's order.
WEDGE_OF_GMSH = [0, 2, 1, 3, 5, 4]
_TURNED = [*WEDGE_OF_GMSH, 8, 7, 6, 11, 10, 9, 12, 14, 13, 17, 16, 15]
TURNED_WEDGES = {"wedge": WEDGE_OF_GMSH, "wedge15": _TURNED[:15], "wedge18": _TURNED}

# What is usual for an array of cells without a type; four nodes are a quad or a tetrahedron.
_BY_WIDTH = {3: "triangle", 5: "pyramid", 6: "wedge", 8: "hexahedron"}
_BY_WIDTH |= {10: "tetra10", 20: "hexahedron20", 27: "hexahedron27"}


class Run(NamedTuple):
    """Cells of one type."""

    kind: CellType
    nodes: IntArray  # [cells, nodes of the type], in the caller's integers
    ids: NDArray[np.int64] | range  # of the cells


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
    runs = list(_runs(cells))
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


def _unsupported(cell: int, name: str) -> InvalidMesh:
    error = InvalidMesh(
        f"element {cell} is of the type {name}; only triangles, quads, tetrahedra, pyramids, "
        "wedges and hexahedra of first and second order can be smoothed",
        reason="ELEMENT_NOT_SUPPORTED",
    )
    error.element = cell
    return error


def _mismatch(what: str) -> InvalidMesh:
    return InvalidMesh(what, reason="ARRAY_SIZE_MISMATCH")


def _runs(cells: Any) -> Iterator[Run]:
    if isinstance(cells, Mapping):
        return _of_blocks(list(cells.items()))
    if isinstance(cells, np.ndarray) and cells.ndim == 2:
        return _of_blocks([(_name_by_width(cells), cells)])
    if isinstance(cells, tuple) and all(np.ndim(array) == 1 for array in cells):
        arrays = [np.asarray(array) for array in cells]
        if len(arrays) == 2:
            return _of_padded(*arrays)
        if len(arrays) == 3:
            return of_flat(arrays[2], arrays[0], arrays[1])
    if isinstance(cells, Sequence) and not isinstance(cells, str):
        return _of_blocks([_type_and_nodes(block) for block in cells])
    raise TypeError(
        f"cells of the type {type(cells).__name__} are not known; they are {{type: array}}, "
        "[(type, array), …], (cells, types) or (offsets, connectivity, types) of VTK, or an array "
        "of one row per triangle, pyramid, wedge or hexahedron"
    )


def _name_by_width(cells: IntArray) -> str:
    if name := _BY_WIDTH.get(cells.shape[1]):
        return name
    raise _mismatch(
        f"an array of {cells.shape[1]} nodes a cell does not tell its type; name it, as in "
        '{"tetra": cells}'
    )


def _type_and_nodes(block: Any) -> tuple[Any, ArrayLike]:
    if hasattr(block, "type") and hasattr(block, "data"):
        return block.type, block.data
    name, nodes = block
    return name, nodes


def _of_blocks(blocks: Sequence[tuple[Any, ArrayLike]]) -> Iterator[Run]:
    first = 0
    for name, array in blocks:
        nodes = np.asarray(array)
        kind = _BY_NAME.get(name) if isinstance(name, str) else _BY_VTK.get(int(name))
        if kind is None and len(nodes):
            raise _unsupported(first, str(name))
        if kind is None or len(nodes) == 0:
            continue
        width = kind.node_count
        if nodes.ndim != 2 or (width and nodes.shape[1] != width):
            raise _mismatch(
                f"the nodes of the cells of type {kind.name} have the shape {nodes.shape}, they "
                f"need (cells, {width})"
            )
        yield Run(kind, nodes, range(first, first + len(nodes)))
        first += len(nodes)


def _of_padded(cells: IntArray, types: IntArray) -> Iterator[Run]:
    """[n, node, …, n, node, …] and the type of each cell."""
    sizes = _sizes_of(types)
    if (sizes == 0).any():  # as long as each cell says itself
        at = 0
        for cell in range(len(types)):
            if at >= len(cells):
                raise _mismatch("the cells end before their types do")
            sizes[cell] = cells[at]
            at += 1 + int(cells[at])
    ends = np.cumsum(sizes + 1)
    total = int(ends[-1]) if len(ends) else 0
    if total != len(cells):
        raise _mismatch(f"the array of cells has {len(cells)} numbers, their types ask for {total}")
    starts = ends - sizes
    if not np.array_equal(cells[starts - 1], sizes):
        raise _mismatch("the array of cells and their types disagree on the number of nodes")
    return _of_starts(types, starts, sizes, cells)


def of_flat(types: IntArray, offsets: IntArray, connectivity: IntArray) -> Iterator[Run]:
    """VTK's arrays: cell c has `connectivity[offsets[c]:offsets[c + 1]]`."""
    if len(offsets) != len(types) + 1:
        raise _mismatch(f"{len(offsets)} offsets for {len(types)} cells, there must be one more")
    return _of_starts(types, offsets[:-1], np.diff(offsets), connectivity)


def _sizes_of(types: IntArray) -> NDArray[np.int64]:
    sizes = _SIZES[np.asarray(types, np.uint8)]
    if len(types) and sizes.min() < 0:
        cell = int(np.flatnonzero(sizes < 0)[0])
        raise _unsupported(cell, f"VTK cell type {types[cell]}")
    return sizes


def _of_starts(
    types: IntArray, starts: IntArray, sizes: IntArray, connectivity: IntArray
) -> Iterator[Run]:
    if len(types) == 0:
        return
    if types.min() == types.max():  # without a sort
        kinds: list[int] = [int(types[0])]
    else:
        found, first = np.unique(types, return_index=True)
        kinds = [int(kind) for kind in found[np.argsort(first)]]
    for vtk in kinds:
        ids = range(len(types)) if len(kinds) == 1 else np.flatnonzero(types == vtk)
        own = sizes if len(kinds) == 1 else sizes[ids]
        for size in _in_order(own):
            all_same = bool((own == size).all())
            chosen = np.asarray(ids) if not all_same else ids
            if not all_same:
                chosen = np.asarray(ids)[own == size]
            kind = _kind_of(vtk, size, int(chosen[0]))
            whole = len(chosen) == len(types) and int(starts[0]) == 0
            if whole and len(connectivity) == size * len(types):
                nodes = connectivity.reshape(len(types), size)
            else:
                at = starts if len(chosen) == len(types) else starts[chosen]
                nodes = connectivity[np.asarray(at)[:, None] + np.arange(size)]
            yield Run(kind, nodes, chosen)


def _in_order(sizes: IntArray) -> list[int]:
    """The different values, in the order of their first appearance."""
    if sizes.min() == sizes.max():
        return [int(sizes[0])]
    values, first = np.unique(sizes, return_index=True)
    return [int(value) for value in values[np.argsort(first)]]


def _kind_of(vtk: int, size: int, cell: int) -> CellType:
    if vtk == _POLYGON and size in (3, 4):
        vtk = 5 if size == 3 else 9
    kind = _BY_VTK.get(vtk)
    if kind is None:
        name = f"polygon of {size} nodes" if vtk == _POLYGON else f"VTK cell type {vtk}"
        raise _unsupported(cell, name)
    if kind.node_count not in (0, size):
        raise _mismatch(f"cell {cell} of type {kind.name} has {size} nodes")
    return kind
