"""The nodes that `move` prescribes, read and checked before anything is sent."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _options
from ._errors import InvalidMesh
from ._mesh import Mesh, chosen_nodes, node_vectors, to_wire
from ._options import MoveOptions
from ._request import Prescribed, Topology, other_positions
from ._service_error import place_in_input

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


def boundary_nodes(topology: Topology) -> NDArray[np.int64]:
    """Returns the nodes of the facets that only one element uses, ascending."""
    runs, places = [], []
    for block in topology.blocks:
        for corners, others in _facets_of(block.element_type):
            run = np.zeros((block.element_count, 4), np.uint32)  # 0: none, others count from 1
            run[:, : len(corners)] = np.sort(block.nodes[:, corners], axis=1) + 1
            runs.append(run)
            places.append((block, others))
    facets = np.concatenate(runs)
    keys = facets.view(np.uint64)  # two to a facet: fewer to sort by
    order = np.lexsort(keys.T)
    is_new = (keys[order[1:]] != keys[order[:-1]]).any(axis=1)
    alone = order[np.append(True, is_new) & np.append(is_new, True)]
    found = [facets[alone].reshape(-1)]
    first = 0
    for block, others in places:
        if others:
            own = alone[(alone >= first) & (alone < first + block.element_count)] - first
            found.append(block.nodes[own][:, others].reshape(-1).astype(np.uint32) + 1)
        first += block.element_count
    nodes = np.unique(np.concatenate(found)).astype(np.int64)
    return nodes[(nodes > 0) & (nodes <= topology.node_count)] - 1


def prescribe(mesh: Mesh, topology: Topology, nodes: Any, positions: ArrayLike) -> Prescribed:
    """Returns the nodes of a session's step.

    Args:
        mesh: the mesh.
        topology: of the mesh.
        nodes: as `chosen_nodes` takes them.
        positions: of these nodes in their order, or of all nodes.
    """
    chosen = _checked(mesh, topology, chosen_nodes(mesh, nodes, "nodes"))
    given = np.asarray(positions)
    if given.shape[:1] == (mesh.node_count,) != chosen.shape:
        given = given[chosen]
    _need_shape(given, (len(chosen), mesh.width), f"the positions of {len(chosen)} nodes need")
    return _prescribed(mesh, chosen, given)


def prescribe_motion(mesh: Mesh, topology: Topology, options: MoveOptions) -> Prescribed:
    """Returns the nodes of `move`, by those of the options that are its own.

    Without `prescribed` they are the boundary's that are not fixed.
    """
    displacement, to = options.get("displacement"), options.get("to")
    if (displacement is None) == (to is None):
        raise _options.misplaced("to", "move needs one of displacement=… and to=…")
    if to is not None:
        positions = other_positions(mesh, to, "to")[:, : mesh.width]
    else:
        if isinstance(displacement, str):
            displacement = node_vectors(mesh, displacement)
        way = np.asarray(displacement)
        _need_shape(way, (mesh.node_count, mesh.width), "the displacement needs")
        positions = mesh.points[:, : mesh.width] + way
    chosen = options.get("prescribed")
    if chosen is not None:
        nodes = chosen_nodes(mesh, chosen, "prescribed")
    else:
        nodes = boundary_nodes(topology)
        if topology.fixed is not None:
            nodes = nodes[topology.fixed[nodes] == 0]
    nodes = _checked(mesh, topology, nodes)
    return _prescribed(mesh, nodes, positions[nodes])


def _checked(mesh: Mesh, topology: Topology, nodes: NDArray[Any]) -> NDArray[np.int32]:
    if len(nodes) == 0:
        raise _options.out_of_range("prescribed", "move needs at least one prescribed node")
    nodes = nodes.astype(np.int64)
    outside = (nodes < 0) | (nodes >= mesh.node_count)
    if outside.any():
        what = f"it is out of range, the mesh has {mesh.node_count} nodes"
        raise _refusal(mesh, nodes[outside], "INDEX_OUT_OF_RANGE", what)
    again = np.bincount(nodes)[nodes] > 1
    if again.any():
        raise _refusal(mesh, nodes[again], "PRESCRIBED_TWICE", "it occurs more than once")
    if topology.fixed is not None and (fixed := topology.fixed[nodes] != 0).any():
        raise _refusal(mesh, nodes[fixed], "PRESCRIBED_AND_FIXED", "it is fixed too")
    return nodes.astype("<i4")


def _prescribed(mesh: Mesh, nodes: NDArray[np.int32], positions: NDArray[Any]) -> Prescribed:
    # A copy: the caller may change the positions, or have the result written there.
    own = np.array(to_wire(positions), mesh.points.dtype, order="C")
    finite = np.isfinite(own).all(axis=1)
    if not finite.all():
        what = "its position is not finite"
        raise _refusal(mesh, nodes[~finite], "NON_FINITE_COORDINATE", what)
    return Prescribed(nodes, own)


def _need_shape(array: NDArray[Any], shape: tuple[int, int], what: str) -> None:
    if array.shape != shape:
        raise InvalidMesh(
            f"{what} the shape {shape}, it is {array.shape}",
            reason="ARRAY_SIZE_MISMATCH",
            details={"array": "PRESCRIBED_COORDINATES"},
        )


def _refusal(mesh: Mesh, nodes: NDArray[Any], reason: str, what: str) -> InvalidMesh:
    node = int(nodes[0])
    error = InvalidMesh(
        f"prescribed node {node}: {what}", reason=reason, details={"node": str(node)}
    )
    error.node = node
    place_in_input(error, 0, mesh.node_count, mesh)
    return error
