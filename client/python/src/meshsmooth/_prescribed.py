"""The nodes that `move` prescribes, read and checked before anything is sent."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import as_coordinates
from ._errors import InvalidMesh, misplaced, out_of_range
from ._facets import boundary_nodes
from ._job_options import MoveOptions
from ._mesh import Mesh, chosen_nodes, node_vectors, to_wire
from ._request import Prescribed, other_positions
from ._service_error import place_in_input
from ._topology import Topology


def prescribe(mesh: Mesh, topology: Topology, nodes: Any, positions: ArrayLike) -> Prescribed:
    """Returns the nodes of a session's step.

    Args:
        mesh: the mesh.
        topology: of the mesh.
        nodes: as `chosen_nodes` takes them.
        positions: of these nodes in their order, or of all nodes.
    """
    chosen = _checked(mesh, topology, chosen_nodes(mesh, nodes, "nodes"))
    given = as_coordinates(positions, "the positions")
    if given.shape[:1] == (mesh.node_count,) != chosen.shape:
        given = given[chosen]
    _need_shape(given, (len(chosen), mesh.width), f"the positions of {len(chosen)} nodes need")
    return _prescribed(mesh, topology, chosen, given)


def prescribe_motion(mesh: Mesh, topology: Topology, options: MoveOptions) -> Prescribed:
    """Returns the nodes of `move`, by those of the options that are its own.

    Without `prescribed` they are the boundary's that are not fixed.
    """
    displacement, to = options.get("displacement"), options.get("to")
    if (displacement is None) == (to is None):
        raise misplaced("to", "move needs one of displacement=… and to=…")
    if to is not None:
        positions = other_positions(mesh, to, "to")[:, : mesh.width]
    else:
        if isinstance(displacement, str):
            displacement = node_vectors(mesh, displacement)
        way = as_coordinates(displacement, "the displacement")
        _need_shape(way, (mesh.node_count, mesh.width), "the displacement needs")
        positions = mesh.points[:, : mesh.width] + way
    chosen = options.get("prescribed")
    if chosen is not None:
        nodes = chosen_nodes(mesh, chosen, "prescribed")
    else:
        nodes = boundary_nodes(topology.blocks, topology.node_count)
        if topology.fixed is not None:
            nodes = nodes[topology.fixed[nodes] == 0]
    nodes = _checked(mesh, topology, nodes)
    return _prescribed(mesh, topology, nodes, positions[nodes])


def _checked(mesh: Mesh, topology: Topology, nodes: NDArray[Any]) -> NDArray[np.int32]:
    if len(nodes) == 0:
        raise out_of_range("prescribed", "move needs at least one prescribed node")
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


def _prescribed(
    mesh: Mesh, topology: Topology, nodes: NDArray[np.int32], positions: NDArray[Any]
) -> Prescribed:
    if topology.representatives is not None:  # of nodes at one position the first counts
        standing, first = np.unique(topology.representatives[nodes], return_index=True)
        nodes, positions = standing.astype("<i4"), positions[first]
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
