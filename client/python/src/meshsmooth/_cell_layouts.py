"""The layouts of cells that Python's mesh packages use."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import as_array
from ._cell_types import (
    BY_VTK,
    POLYGON,
    SIZES,
    UNFOLDED,
    CellType,
    find_type,
    meant_by,
    vtk_type_hint,
    vtk_type_text,
)
from ._errors import InvalidMesh

IntArray = NDArray[Any]

# What is usual for an array of cells without a type; four nodes are a quad or a tetrahedron.
_BY_WIDTH = {3: "triangle", 5: "pyramid", 6: "wedge", 8: "hexahedron"}
_BY_WIDTH |= {10: "tetra10", 20: "hexahedron20", 27: "hexahedron27"}


class Run(NamedTuple):
    """Cells of one type."""

    kind: CellType
    nodes: IntArray  # [cells, nodes of the type], in the caller's integers
    ids: NDArray[np.int64] | range  # of the cells


def _unsupported(cell: int, what: str, hint: str = "") -> InvalidMesh:
    error = InvalidMesh(
        f"element {cell} {what}; only triangles, quads, tetrahedra, pyramids, wedges and hexahedra "
        "of first and second order can be smoothed",
        reason="ELEMENT_NOT_SUPPORTED",
        hint=hint,
    )
    error.element = cell
    return error


def _mismatch(what: str) -> InvalidMesh:
    return InvalidMesh(what, reason="ARRAY_SIZE_MISMATCH")


def read_runs(cells: Any) -> Iterator[Run]:
    """Yields the cells, in runs of one type."""
    if isinstance(cells, Mapping):
        return _of_blocks(list(cells.items()))
    if isinstance(cells, tuple) and len(cells) in (2, 3) and all(map(_is_row, cells)):
        arrays = [_whole_numbers(as_array(array, "the cells")) for array in cells]
        return _of_padded(*arrays) if len(arrays) == 2 else of_flat(arrays[2], *arrays[:2])
    if _is_rows(cells):
        rows = as_array(cells, "the cells")
        return _of_blocks([(_name_by_width(rows), rows)])
    if isinstance(cells, Sequence) and not isinstance(cells, str):
        blocks = [_type_and_nodes(block) for block in cells]
        if all(block is not None for block in blocks):
            return _of_blocks([block for block in blocks if block is not None])
    raise TypeError(
        f"cells of the type {type(cells).__name__} are not known; they are {{type: array}}, "
        "[(type, array), …], (cells, types) or (offsets, connectivity, types) of VTK, or an array "
        "of one row per triangle, pyramid, wedge or hexahedron"
    )


def _whole_numbers(array: IntArray) -> IntArray:
    if array.size and array.dtype.kind not in "iu":
        raise _mismatch(
            f"VTK's arrays of cells are of whole numbers; one of them has the type {array.dtype}"
        )
    return array


def _is_rows(cells: Any) -> bool:
    """Whether cells are rows of nodes, all of one type that is not named."""
    if isinstance(cells, Sequence) and not isinstance(cells, str):
        return bool(cells) and _is_row(cells[0])
    foreign = hasattr(cells, "__dlpack__") and not hasattr(cells, "__array__")
    return foreign or getattr(cells, "ndim", 0) == 2


def _is_row(nodes: Any) -> bool:
    if isinstance(nodes, Sequence) and not isinstance(nodes, str):
        return all(isinstance(node, Integral) for node in nodes)
    return getattr(nodes, "ndim", 0) == 1


def _name_by_width(cells: IntArray) -> str:
    if name := _BY_WIDTH.get(cells.shape[1]):
        return name
    raise _mismatch(
        f"an array of {cells.shape[1]} nodes a cell does not tell its type; name it, as in "
        '{"tetra": cells}'
    )


def _type_and_nodes(block: Any) -> tuple[Any, ArrayLike] | None:
    if hasattr(block, "type") and hasattr(block, "data"):
        return block.type, block.data
    if isinstance(block, Sequence) and len(block) == 2 and isinstance(block[0], str | Integral):
        return block[0], block[1]
    return None


def _of_blocks(blocks: Sequence[tuple[Any, ArrayLike]]) -> Iterator[Run]:
    first = 0
    for name, array in blocks:
        if not isinstance(name, str | Integral):
            raise TypeError(f"{name!r} is neither the name nor VTK's number of a type of cells")
        nodes = as_array(array, f"the cells of type {name!r}")
        if nodes.ndim == 0:
            raise TypeError(
                f"the cells of type {name!r} are a {type(array).__name__}, not an array [cells, "
                "nodes of the type]"
            )
        kind = find_type(name)
        if kind is None and len(nodes):
            if isinstance(name, str):
                raise _unsupported(first, f"has the unknown type {name!r}", meant_by(name))
            raise _unsupported(first, f"is a {vtk_type_text(int(name))}", vtk_type_hint(int(name)))
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
    if offsets.dtype.kind == "u":
        offsets = offsets.astype(np.int64)  # else their differences wrap round
    shrinking = np.flatnonzero(np.diff(offsets) < 0)
    if len(shrinking):
        error = _mismatch(f"cell {shrinking[0]}: its nodes end before they begin, by the offsets")
        error.element = int(shrinking[0])
        raise error
    if offsets[0] != 0 or offsets[-1] != len(connectivity):
        raise _mismatch(
            f"the offsets run from {offsets[0]} to {offsets[-1]}; for a connectivity of "
            f"{len(connectivity)} nodes they must run from 0 to {len(connectivity)}"
        )
    return _of_starts(types, offsets[:-1], np.diff(offsets), connectivity)


def _sizes_of(types: IntArray) -> NDArray[np.int64]:
    wide = types.astype(np.int64)
    sizes = np.where((wide >= 0) & (wide < len(SIZES)), SIZES[wide % len(SIZES)], -1)
    if len(types) and sizes.min() < 0:
        cell = int(np.flatnonzero(sizes < 0)[0])
        vtk = int(types[cell])
        raise _unsupported(cell, f"is a {vtk_type_text(vtk)}", vtk_type_hint(vtk))
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
            if vtk in UNFOLDED:
                nodes = nodes[:, UNFOLDED[vtk][1]]
            yield Run(kind, nodes, chosen)


def _in_order(sizes: IntArray) -> list[int]:
    """The different values, in the order of their first appearance."""
    if sizes.min() == sizes.max():
        return [int(sizes[0])]
    values, first = np.unique(sizes, return_index=True)
    return [int(value) for value in values[np.argsort(first)]]


def _kind_of(vtk: int, size: int, cell: int) -> CellType:
    if vtk == POLYGON and size in (3, 4):
        vtk = 5 if size == 3 else 9
    vtk = UNFOLDED.get(vtk, (vtk,))[0]
    kind = BY_VTK.get(vtk)
    if kind is None:
        nodes = size if vtk == POLYGON else None
        raise _unsupported(cell, f"is a {vtk_type_text(vtk, nodes)}", vtk_type_hint(vtk))
    if kind.node_count not in (0, size):
        raise _mismatch(f"cell {cell} of type {kind.name} has {size} nodes")
    return kind
