"""A job as it is asked for: what every attempt at it sends."""

from __future__ import annotations

import functools
import os
import uuid
from typing import Any, NamedTuple

import numpy as np
from google.protobuf import duration_pb2
from numpy.typing import NDArray

from . import _options, _wire
from ._adapters import find_adapter, is_mesh, read_mesh
from ._arrays import as_coordinates
from ._checks import check_options
from ._coincident import merged
from ._errors import InvalidMesh, misplaced
from ._job_options import JobOptions
from ._mesh import Mesh, to_wire
from ._periodic import node_pairs
from ._surface import read_surface
from ._topology import Topology, TopologyUse, scalar_type
from .v1 import smoothing_pb2

_WEEK = 7 * 24 * 3600.0


class Prescribed(NamedTuple):
    """Nodes of a mesh, each once, and where they shall lie; or what a derivative is given.

    Attributes:
        nodes: which nodes.
        vectors: positions or tangents of these nodes, or cotangents of all, [n, 3], in the type of
            the mesh's.
        derivative: `Move.derivative` on the wire.
    """

    nodes: NDArray[np.int32]
    vectors: NDArray[Any]
    derivative: smoothing_pb2.Derivative = smoothing_pb2.DERIVATIVE_NONE

    def arrays(self) -> list[tuple[int, NDArray[Any]]]:
        """Returns the arrays in the order of the wire."""
        nodes = (_wire.PRESCRIBED_NODES, self.nodes)
        if self.derivative == smoothing_pb2.DERIVATIVE_COTANGENT:
            return [(_wire.COORDINATES, self.vectors), nodes]
        return [nodes, (_wire.PRESCRIBED_COORDINATES, self.vectors)]


class Request:
    """All that defines a job, checked and encoded once."""

    def __init__(
        self,
        mesh: Mesh,
        options: JobOptions,
        topology: Topology | None = None,
        prescribed: Prescribed | None = None,
    ) -> None:
        """Reads the options of a job on a mesh.

        Args:
            mesh: the mesh.
            options: of the job.
            topology: of the mesh, if it is known.
            prescribed: nodes that move, and the mesh with them; the topology has its positions.

        Raises:
            InvalidOption: an option has no such value or means nothing here.
            InvalidMesh: the mesh cannot be encoded.
        """
        check_options(options)
        options = _options.slide_on_surface(options)
        self.mesh = mesh
        self.options = options
        self.points = mesh.points
        self.message = _options.encode_options(options)
        self.prescribed = prescribed
        if self.message.HasField("move") and prescribed is None:
            raise misplaced("method", 'method="move" is that of move(…), not of smooth(…)')
        if prescribed is not None and prescribed.derivative != smoothing_pb2.DERIVATIVE_NONE:
            self.message.move.derivative = prescribed.derivative
        self.metrics: list[Any] = _options.to_metrics(options.get("element_quality"))
        self.topology = topology or Topology.of(mesh, options)
        self.reference = self._read_reference()
        given = options.get("surface")
        self.surface = None if given is None else read_surface(given)
        self.node_pairs = node_pairs(mesh, options)
        of = self.topology.representatives
        if self.node_pairs is not None and of is not None:
            self.node_pairs = np.ascontiguousarray(merged(self.node_pairs, of), np.dtype("<i4"))
        self.request_id = options.get("request_id") or str(uuid.uuid4())
        self.max_attempts = options.get("max_attempts") or 4
        timeout = options.get("timeout")
        self.timeout = (
            self._default_timeout() if timeout is None else _options.to_seconds("timeout", timeout)
        )

    def _read_reference(self) -> NDArray[Any] | None:
        reference = self.options.get("reference")
        if reference is None:
            return None
        return other_positions(self.mesh, reference, "reference")

    def _default_timeout(self) -> float:
        """As the C++ client: by the size of what may travel and the sweeps that it may take."""
        sweeps = _options.default_iterations(self.options)
        return min(
            600 + 1e-6 * self.input_bytes + 10e-6 * self.topology.element_count * sweeps, _WEEK
        )

    def spec(self, use: TopologyUse, *, with_progress: bool) -> smoothing_pb2.SmoothRequest:
        """Returns the first message of an attempt."""
        message = smoothing_pb2.SmoothRequest()
        spec = message.spec
        spec.request_id = self.request_id
        if use.named:
            spec.topology_name = self.topology.name
        else:
            spec.inline_topology.CopyFrom(self.topology.spec())
            spec.topology_kept = use.kept
        spec.coordinate_type = scalar_type(self.points)
        if self.prescribed is not None:
            spec.prescribed_node_count = len(self.prescribed.nodes)
        if self.node_pairs is not None:
            spec.node_pair_count = len(self.node_pairs)
        if self.surface is not None:
            spec.surface.CopyFrom(self.surface.spec())
        spec.options.CopyFrom(self.message)
        _options.encode_job(self.options, spec)
        if with_progress:
            spec.progress_interval.CopyFrom(duration_pb2.Duration(nanos=100_000_000))
        spec.element_quality_metrics.extend(self.metrics)
        return message

    def parts(self, use: TopologyUse) -> list[_wire.Part]:
        """Returns the arrays of an attempt in the order of the wire."""
        parts = [] if use.named else list(self.topology.parts())
        own: list[tuple[int, NDArray[Any]]]
        if self.prescribed is not None:
            own = self.prescribed.arrays()
        else:
            own = [(_wire.COORDINATES, self.points)]
            if self.reference is not None:
                own.append((_wire.REFERENCE_COORDINATES, self.reference))
        if self.node_pairs is not None:
            own.append((_wire.NODE_PAIRS, self.node_pairs))
        if self.surface is not None:
            own += self.surface.arrays()
        return parts + [_wire.Part(array_id, 0, _wire.bytes_of(array)) for array_id, array in own]

    @functools.cached_property
    def input_bytes(self) -> int:
        """The size of all arrays that may have to be sent."""
        return sum(part.data.nbytes for part in self.parts(TopologyUse()))

    @property
    def is_small(self) -> bool:
        """Whether it is sent without waiting for the server, and takes little time by itself."""
        return self.input_bytes + self.result_bytes < _wire.SMALL_BYTES

    @property
    def result_bytes(self) -> int:
        """The size of the arrays of the result."""
        return self.points.nbytes + 4 * len(self.metrics) * self.topology.element_count

    def metadata(self, use: TopologyUse) -> list[tuple[str, str]]:
        """Returns what proxies read of an attempt, and the caller's span."""
        metadata = []
        if use.routed:
            metadata.append(("meshsmooth-topology", self.topology.name.rpartition("-")[2]))
        if self.options.get("traceparent"):
            metadata.append(("traceparent", self.options["traceparent"]))
        return metadata


def other_positions(mesh: Mesh, given: Any, field: str) -> NDArray[Any]:
    """Returns other positions of a mesh, [nodes, 3] in its type, as an option gives them.

    Args:
        mesh: the mesh.
        given: an array of positions, or a mesh with the same elements.
        field: the option, for errors.
    """
    if isinstance(given, str | os.PathLike):
        find_adapter(given)  # says that it is a path
    if not is_mesh(given):
        positions = to_wire(as_coordinates(given, f"the positions of {field}"), mesh.width)
    else:
        other = read_mesh(given)
        positions = other.points
        if not other.has_elements_of(mesh):
            raise _differs(field)
    if positions.shape != mesh.points.shape:
        raise _differs(field)
    return np.ascontiguousarray(positions, mesh.points.dtype)


def _differs(field: str) -> InvalidMesh:
    return InvalidMesh(
        f"{field} must have the same elements of the same nodes, in the same order, in other "
        "positions; this one differs",
        reason="REFERENCE_DIFFERS",
        details={"field": field},
    )
