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
from .v1 import smoothing_pb2


def prescribe(mesh: Mesh, topology: Topology, nodes: Any, positions: ArrayLike) -> Prescribed:
    """Returns the nodes of a session's step.

    Args:
        mesh: the mesh.
        topology: of the mesh.
        nodes: as `chosen_nodes` takes them.
        positions: of these nodes in their order, or of all nodes.
    """
    chosen = _checked(mesh, topology, chosen_nodes(mesh, nodes, "nodes"))
    given = _vectors_of(mesh, chosen, positions, "positions")
    return _prescribed(mesh, topology, chosen, given)


def prescribe_tangents(
    mesh: Mesh, topology: Topology, nodes: Any, tangents: ArrayLike
) -> Prescribed:
    """Returns the nodes of a derivative, forward; arguments as of `prescribe`."""
    chosen = _checked(mesh, topology, chosen_nodes(mesh, nodes, "nodes"))
    given = _vectors_of(mesh, chosen, tangents, "tangents")
    prescribed = _prescribed(mesh, topology, chosen, given)
    return prescribed._replace(derivative=smoothing_pb2.DERIVATIVE_TANGENT)


def rows_among_all(shape: tuple[int, ...], node_count: int, nodes: Any) -> NDArray[Any] | None:
    """Returns the rows of prescribed nodes in vectors of all nodes.

    Args:
        shape: of the vectors.
        node_count: of the mesh.
        nodes: prescribed nodes: indices or a boolean mask.

    Returns:
        None if the vectors are those of the prescribed nodes alone.
    """
    chosen = np.asarray(nodes)
    if chosen.dtype == bool:
        chosen = chosen.nonzero()[0]
    return chosen if shape[:1] == (node_count,) != chosen.shape else None


class Cotangents:
    """The nodes of a derivative, backward.

    Attributes:
        prescribed: what the job is given.
    """

    def __init__(self, mesh: Mesh, topology: Topology, nodes: Any, cotangents: ArrayLike) -> None:
        """Reads them.

        Args:
            mesh: the mesh.
            topology: of the mesh.
            nodes: as `chosen_nodes` takes them.
            cotangents: of all nodes.
        """
        chosen = _checked(mesh, topology, chosen_nodes(mesh, nodes, "nodes"))
        given = as_coordinates(cotangents, "the cotangents")
        _need_shape(given, (mesh.node_count, mesh.width), "the cotangents of all nodes need")
        own = np.array(to_wire(given), mesh.points.dtype, order="C")
        self._need_finite(mesh, own)
        self._count = len(chosen)
        self._first: NDArray[Any] = np.arange(len(chosen))
        if topology.representatives is not None:  # nodes at one position move together
            standing, self._first = np.unique(topology.representatives[chosen], return_index=True)
            chosen, given = standing.astype("<i4"), own
            own = np.zeros_like(given)
            np.add.at(own, topology.representatives, given)
        self.prescribed = Prescribed(chosen, own, smoothing_pb2.DERIVATIVE_COTANGENT)

    def of_prescribed(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Returns the vectors of the prescribed nodes in the caller's order, from those of all."""
        result = np.zeros((self._count, vectors.shape[1]), vectors.dtype)
        result[self._first] = vectors[self.prescribed.nodes]
        return result

    @staticmethod
    def _need_finite(mesh: Mesh, vectors: NDArray[Any]) -> None:
        finite = np.isfinite(vectors).all(axis=1)
        if finite.all():
            return
        node = int((~finite).nonzero()[0][0])
        error = InvalidMesh(
            f"node {node}: its cotangent is not finite",
            reason="NON_FINITE_COORDINATE",
            details={"node": str(node)},
        )
        error.node = node
        raise error


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


def _vectors_of(
    mesh: Mesh, chosen: NDArray[Any], vectors: ArrayLike, what: str
) -> NDArray[Any]:
    """Returns vectors of chosen nodes, which are given alone or among those of all."""
    given = as_coordinates(vectors, f"the {what}")
    rows = rows_among_all(given.shape, mesh.node_count, chosen)
    if rows is not None:
        given = given[rows]
    _need_shape(given, (len(chosen), mesh.width), f"the {what} of {len(chosen)} nodes need")
    return given


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
