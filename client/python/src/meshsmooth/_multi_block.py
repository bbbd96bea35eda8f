"""Blocks of VTK and PyVista as one mesh.

Nodes and cells count through all blocks. What lies at the same position in two blocks are two
nodes, unless `merge_coincident` is set.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._adapter import Adapter, Points
from ._arrays import LazyArrays
from ._errors import InvalidMesh
from ._mesh import MeshData


def multi_block_adapter(adapter_of: Any) -> Adapter:
    """Returns the adapter of blocks, nested or not, each of which `adapter_of` has one for."""

    def read(mesh: Any) -> MeshData:
        data = [adapter_of(block).read(block) for block in _leaves(mesh)]
        if not data:
            raise InvalidMesh("the blocks have no nodes", reason="MESH_EMPTY")
        return MeshData(
            np.concatenate([np.asarray(own.points) for own in data]),
            _joined_cells(data),
            point_data=_joined_arrays([own.point_data for own in data]),
            cell_data=_joined_arrays([own.cell_data for own in data]),
        )

    def write(mesh: Any, points: Points) -> Any:
        counts = [block.GetNumberOfPoints() for block in _leaves(mesh)]
        pieces = iter(np.split(points, np.cumsum(counts)[:-1]))
        return _replaced(mesh, lambda block: adapter_of(block).write(block, next(pieces)))

    def annotate(mesh: Any, name: str, values: NDArray[np.float32]) -> None:
        blocks = list(_leaves(mesh))
        ends = np.cumsum([block.GetNumberOfCells() for block in blocks])
        for block, own in zip(blocks, np.split(values, ends[:-1]), strict=True):
            annotate_block = adapter_of(block).annotate
            if annotate_block is not None:
                annotate_block(block, name, own)

    return Adapter(read, write, annotate)


def _is_leaf(block: Any) -> bool:
    return block is not None and not block.IsA("vtkMultiBlockDataSet") and block.GetNumberOfPoints()


def _leaves(mesh: Any) -> Iterator[Any]:
    """The blocks that have nodes, in order."""
    for number in range(mesh.GetNumberOfBlocks()):
        block = mesh.GetBlock(number)
        if _is_leaf(block):
            yield block
        elif block is not None and block.IsA("vtkMultiBlockDataSet"):
            yield from _leaves(block)


def _replaced(mesh: Any, write_block: Any) -> Any:
    """The same blocks with others in place of the leaves."""
    if hasattr(mesh, "copy"):  # PyVista's
        result = mesh.copy(deep=False)
    else:
        result = mesh.NewInstance()
        result.ShallowCopy(mesh)
    for number in range(mesh.GetNumberOfBlocks()):
        block = mesh.GetBlock(number)
        if _is_leaf(block):
            result.SetBlock(number, write_block(block))
        elif block is not None and block.IsA("vtkMultiBlockDataSet"):
            result.SetBlock(number, _replaced(block, write_block))
    return result


def _joined_cells(data: Sequence[MeshData]) -> Any:
    """VTK's offsets, connectivity and types of all blocks."""
    offsets, connectivity, types = [np.zeros(1, np.int64)], [], []
    node_count = 0
    for own in data:
        if len(own.cells):
            own_offsets, own_connectivity, own_types = own.cells
            offsets.append(np.asarray(own_offsets[1:], np.int64) + offsets[-1][-1])
            connectivity.append(np.asarray(own_connectivity, np.int64) + node_count)
            types.append(own_types)
        node_count += len(np.asarray(own.points))
    if not types:
        return []
    return np.concatenate(offsets), np.concatenate(connectivity), np.concatenate(types)


def _joined_arrays(arrays: Sequence[Mapping[str, ArrayLike]]) -> LazyArrays:
    """Those that all blocks have."""
    names = [name for name in arrays[0] if all(name in others for others in arrays[1:])]
    return LazyArrays(names, lambda name: np.concatenate([np.asarray(own[name]) for own in arrays]))
