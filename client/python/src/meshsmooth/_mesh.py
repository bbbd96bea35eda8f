"""A mesh between an adapter and the wire."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import as_array, as_coordinates
from ._cell_types import VOLUMES
from ._cells import Cells, parse_cells
from ._errors import InvalidMesh, InvalidOption, out_of_range
from ._facets import inner_nodes


@dataclass(frozen=True)
class MeshData:
    """What an adapter reads of a mesh.

    Attributes:
        points: node positions, [nodes, 2] or [nodes, 3]; float32 and float64 keep their type.
        cells: in any layout of docs/python.md ("Cells").
        point_data: arrays [nodes] or [nodes, 2 or 3] by name, for `fixed` and `displacement`.
        cell_data: one number per cell by name, for `regions`; cells count through all blocks.
        node_sets: indices of nodes by name, for `fixed`.
        cell_ids: the caller's number of each cell, for errors and the summary; None: its index.
        node_ids: the caller's number of each node, likewise.
        node_pairs: nodes that belong together by the mesh itself, [pairs, 2]; None: none.
    """

    points: ArrayLike
    cells: Any
    point_data: Mapping[str, ArrayLike] = field(default_factory=dict)
    cell_data: Mapping[str, ArrayLike] = field(default_factory=dict)
    node_sets: Mapping[str, ArrayLike] = field(default_factory=dict)
    cell_ids: NDArray[np.int64] | None = None
    node_ids: NDArray[np.int64] | None = None
    node_pairs: NDArray[np.int64] | None = None


class Mesh:
    """A mesh as it travels, and how the caller numbers and types it."""

    def __init__(self, data: MeshData) -> None:
        points = as_coordinates(data.points, "the points")
        self.points = to_wire(points)
        self._data = data
        self.width: int = points.shape[1]
        self.dtype: np.dtype[Any] = (
            points.dtype if points.dtype.kind == "f" else np.dtype(np.float64)
        )

    def moved(self, points: NDArray[Any]) -> Mesh:
        """Returns the mesh with other positions [nodes, 2 or 3] of float32 or float64."""
        if points.shape[:1] != self.points.shape[:1]:
            raise InvalidMesh(
                f"{len(points)} positions for a mesh of {self.node_count} nodes",
                reason="ARRAY_SIZE_MISMATCH",
                details={"array": "COORDINATES"},
            )
        other = Mesh(dataclasses.replace(self._data, points=points))
        other.__dict__["cells"] = self.cells
        return other

    @functools.cached_property
    def cells(self) -> Cells:
        """The cells, parsed at first use: a session's steps have no need of them."""
        cells = parse_cells(self._data.cells)
        if self.width == 2 and any(VOLUMES[block.element_type] for block in cells.blocks):
            raise InvalidMesh(
                "the points have 2 coordinates, the cells of a volume need 3",
                reason="ARRAY_SIZE_MISMATCH",
                details={"array": "COORDINATES"},
            )
        return cells

    def has_elements_of(self, other: Mesh) -> bool:
        """Returns whether it has the same elements of the same nodes, in the same order."""
        blocks = self.cells.blocks, other.cells.blocks
        return len(blocks[0]) == len(blocks[1]) and all(
            mine.element_type == theirs.element_type and np.array_equal(mine.nodes, theirs.nodes)
            for mine, theirs in zip(*blocks, strict=True)
        )

    @property
    def node_count(self) -> int:
        """The number of nodes."""
        return len(self.points)

    @property
    def data(self) -> MeshData:
        """What the adapter read."""
        return self._data

    def caller_element(self, element: int) -> int:
        """Returns the caller's number of an element."""
        cells = self.cells.element_cells
        cell = element if cells is None else int(cells[element])
        ids = self._data.cell_ids
        return cell if ids is None else int(ids[cell])

    def caller_node(self, node: int) -> int:
        """Returns the caller's number of a node."""
        ids = self._data.node_ids
        return node if ids is None else int(ids[node])

    def from_wire(self, positions: NDArray[Any]) -> NDArray[Any]:
        """Returns positions [nodes, 3] in the caller's shape and type; a copy only if it must."""
        return positions[:, : self.width].astype(self.dtype, copy=False)

    def elements_to_cells(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Returns values of the elements as values of the caller's cells; NaN elsewhere."""
        cells = self.cells
        if cells.element_cells is None and cells.cell_count == cells.element_count:
            return values
        result = np.full(cells.cell_count, np.nan, np.float32)
        where = cells.element_cells
        result[slice(len(values)) if where is None else where] = values
        return result


def to_wire(points: NDArray[Any], width: int | None = None) -> NDArray[Any]:
    """Returns positions as they travel: [nodes, 3], little-endian float32 or float64, C order.

    Raises:
        InvalidMesh: they have another shape than [nodes, 2 or 3], or than [nodes, `width`].
    """
    widths = (2, 3) if width is None else (width,)
    if points.ndim != 2 or points.shape[1] not in widths:
        need = " or ".join(f"(nodes, {allowed})" for allowed in widths)
        raise InvalidMesh(
            f"the points have the shape {points.shape}, they need {need}",
            reason="ARRAY_SIZE_MISMATCH",
            details={"array": "COORDINATES"},
        )
    dtype = np.dtype("<f4") if points.dtype.itemsize <= 4 else np.dtype("<f8")
    if points.dtype.kind != "f":
        dtype = np.dtype("<f8")
    if points.shape[1] == 3:
        return np.ascontiguousarray(points, dtype)
    result = np.zeros((len(points), 3), dtype)
    result[:, :2] = points
    return result


def fixed_mask(mesh: Mesh, fixed: Any, fixed_types: tuple[int, ...]) -> NDArray[np.uint8] | None:
    """Returns 1 for each node that must stay, or None if all may move.

    Args:
        mesh: the mesh.
        fixed: nodes, as `chosen_nodes` takes them; None: no node.
        fixed_types: meshsmooth.v1.ElementTypes whose nodes are fixed.
    """
    if fixed is None and not fixed_types:
        return None
    mask = np.zeros(mesh.node_count, np.uint8)
    for block in mesh.cells.blocks:
        if block.element_type in fixed_types:
            _mark(mask, block.nodes.reshape(-1))
    if fixed is not None:
        _mark(mask, chosen_nodes(mesh, fixed, "fixed"), "fixed")
    return mask if mask.any() else None


def lower_dimensional_mask(mesh: Mesh) -> NDArray[np.uint8] | None:
    """Returns 1 for each node of a lower-dimensional cell, or None if there are none."""
    if not mesh.cells.lower_dimensional:
        return None
    mask = np.zeros(mesh.node_count, np.uint8)
    for run in mesh.cells.lower_dimensional:
        _mark(mask, run.nodes.reshape(-1))
    return mask if mask.any() else None


def inner_mask(mesh: Mesh, regions: NDArray[np.int32] | None) -> NDArray[np.uint8] | None:
    """Returns 1 for each node of a lower-dimensional cell inside a region, or None without any."""
    cells = mesh.cells
    if not cells.lower_dimensional:
        return None
    mask = np.zeros(mesh.node_count, np.uint8)
    mask[inner_nodes(cells.blocks, cells.lower_dimensional, mesh.node_count, regions)] = 1
    return mask if mask.any() else None


def chosen_nodes(mesh: Mesh, chosen: Any, field_name: str) -> NDArray[Any]:
    """Returns the indices of nodes that an option chooses; they may not exist.

    Args:
        mesh: the mesh.
        chosen: a boolean mask [nodes], indices of nodes, the name of a node array (not 0: chosen)
            or of a set, or a list of names.
        field_name: the option, for errors.
    """
    names = [chosen] if isinstance(chosen, str) else chosen
    if isinstance(names, list | tuple) and names and all(isinstance(name, str) for name in names):
        mask = np.zeros(mesh.node_count, np.uint8)
        for name in names:
            _mark_by_name(mask, mesh, name, field_name)
        return np.flatnonzero(mask)
    return _node_indices(mesh, as_array(chosen, field_name), field_name)


def _node_indices(mesh: Mesh, chosen: NDArray[Any], field_name: str) -> NDArray[Any]:
    if chosen.dtype == np.bool_:
        if chosen.shape != (mesh.node_count,):
            raise out_of_range(
                field_name,
                f"the mask has the shape {chosen.shape}, the mesh has {mesh.node_count} nodes",
            )
        return np.flatnonzero(chosen)
    if chosen.size == 0:
        return np.zeros(0, np.int64)
    if chosen.dtype.kind not in "iu" or chosen.ndim != 1:
        raise out_of_range(
            field_name,
            f"{field_name} takes a boolean mask, indices of nodes, or the name of an array or set",
        )
    if len(chosen) == mesh.node_count > 2 and chosen.max() <= 1:
        raise out_of_range(
            field_name,
            f"{field_name} has a 0 or 1 for each node, which as indices are the first two nodes; "
            f"for a mask give {field_name}.astype(bool)",
        )
    return chosen


def _mark(mask: NDArray[np.uint8], nodes: NDArray[Any], field_name: str = "") -> None:
    """Nodes of cells that do not exist are the server's to refuse; those of an option are ours."""
    outside = (nodes < 0) | (nodes >= len(mask))
    if outside.any():
        if field_name:
            raise out_of_range(
                field_name,
                f"node {nodes[outside][0]} is not in the mesh; its nodes count from 0 to "
                f"{len(mask) - 1}",
            )
        nodes = nodes[~outside]
    mask[nodes] = 1


def _mark_by_name(mask: NDArray[np.uint8], mesh: Mesh, name: str, field_name: str) -> None:
    data = mesh.data
    found = False
    if name in data.node_sets:
        found = True
        _mark(mask, np.asarray(data.node_sets[name]), field_name)
    if name in data.point_data:
        values = np.asarray(data.point_data[name])
        if values.shape == mask.shape:
            found = True
            mask[(values != 0) & (values == values)] = 1  # neither 0 nor NaN
    if not found:
        arrays = _names_of_shape(data.point_data, mask.shape)
        raise unknown_name(
            "no node set and no node array of one number a node",
            name,
            data.node_sets,
            arrays,
            hint="it is an array of the cells" if name in data.cell_data else "",
        )


def _names_of_shape(arrays: Mapping[str, ArrayLike], shape: tuple[int, ...]) -> list[str]:
    return [name for name in arrays if np.shape(arrays[name]) == shape]


def node_vectors(mesh: Mesh, name: str) -> NDArray[Any]:
    """Returns a node array of as many numbers a node as the points have."""
    arrays, shape = mesh.data.point_data, (mesh.node_count, mesh.width)
    if name in arrays and np.shape(arrays[name]) == shape:
        return np.asarray(arrays[name])
    what = f"no node array of {mesh.width} numbers a node"
    raise unknown_name(what, name, _names_of_shape(arrays, shape))


def unknown_name(what: str, name: str, *known: Iterable[str], hint: str = "") -> InvalidOption:
    """Returns the error of a name that a mesh does not have."""
    names = [repr(other) for some in known for other in some]
    known_names = f"; known are {', '.join(names)}" if names else "; the mesh has none"
    return InvalidOption(
        f"{what} is called {name!r}{known_names}",
        reason="NAME_UNKNOWN",
        details={"name": name},
        hint=hint,
    )
