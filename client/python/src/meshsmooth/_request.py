"""A job as it is asked for: what every attempt at it sends."""

from __future__ import annotations

import functools
import hashlib
import itertools
import uuid
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from google.protobuf import duration_pb2
from numpy.typing import NDArray

from . import _options, _wire
from ._adapters import find_adapter
from ._cells import Block
from ._errors import InvalidMesh
from ._mesh import Mesh, element_regions, fixed_mask, to_wire
from ._options import JobOptions
from .v1 import mesh_pb2, smoothing_pb2

# Options that are a part of the topology: a session takes them when it opens.
TOPOLOGY_OPTIONS = ("fixed", "fixed_types", "regions", "boundary")

_KNOWN = frozenset(JobOptions.__annotations__)
_WEEK = 7 * 24 * 3600.0


class Topology:
    """A mesh without its positions: elements, fixed nodes, regions."""

    def __init__(
        self,
        node_count: int,
        blocks: list[Block],
        fixed: NDArray[np.uint8] | None,
        regions: NDArray[np.int32] | None,
    ) -> None:
        self.node_count = node_count
        self.blocks = blocks
        self.fixed = fixed
        self.regions = regions

    @classmethod
    def of(cls, mesh: Mesh, options: JobOptions) -> Topology:
        """Returns the topology of a mesh with those of the options that belong to it."""
        boundary = options.get("boundary") or "fixed"
        _options.to_choice("boundary", boundary)
        # With a free boundary, lower-dimensional cells move with their nodes, and with a sliding
        # one the boundary's rules hold for their nodes too.
        return cls(
            mesh.node_count,
            mesh.cells.blocks,
            fixed_mask(
                mesh,
                options.get("fixed"),
                _element_types(options.get("fixed_types")),
                lower_dimensional=boundary == "fixed",
            ),
            element_regions(mesh, options.get("regions", "auto"), boundary == "free"),
        )

    @property
    def element_count(self) -> int:
        """The number of elements."""
        return sum(block.element_count for block in self.blocks)

    def spec(self) -> mesh_pb2.TopologySpec:
        """Returns the announcement of the arrays."""
        spec = mesh_pb2.TopologySpec(
            node_count=self.node_count,
            fixed_mask_present=self.fixed is not None,
            element_regions_present=self.regions is not None,
        )
        for block in self.blocks:
            spec.element_blocks.add(
                element_type=block.element_type, element_count=block.element_count
            )
        return spec

    def parts(self) -> Iterator[_wire.Part]:
        """Yields the arrays in the order of the wire."""
        offset_bytes = 0
        for block in self.blocks:
            data = _wire.node_bytes(block.nodes)
            yield _wire.Part(_wire.ELEMENTS, offset_bytes, data)
            offset_bytes += data.nbytes
        if self.fixed is not None:
            yield _wire.Part(_wire.FIXED_MASK, 0, _wire.bytes_of(self.fixed))
        if self.regions is not None:
            yield _wire.Part(_wire.ELEMENT_REGIONS, 0, _wire.bytes_of(self.regions))

    @functools.cached_property
    def name(self) -> str:
        """The server's name of the topology, "topologies/sha256-…"; hashed at first use."""
        numbers = [self.node_count, len(self.blocks)]
        for block in self.blocks:
            numbers += [block.element_type, block.element_count]
        numbers += [int(self.fixed is not None), int(self.regions is not None)]
        digest = hashlib.sha256(np.array(numbers, "<i8").tobytes())
        for part in self.parts():
            for piece in _wire.pieces(part.data):
                digest.update(piece)
        return f"topologies/sha256-{digest.hexdigest()}"


class TopologyUse(NamedTuple):
    """How an attempt names or sends its topology.

    Attributes:
        named: by its name alone.
        kept: inline, and kept under its name.
        routed: with the metadata by which a proxy finds the server that has it.
    """

    named: bool = False
    kept: bool = False
    routed: bool = False


class Request:
    """All that defines a job, checked and encoded once."""

    def __init__(self, mesh: Mesh, options: JobOptions, topology: Topology | None = None) -> None:
        """Reads the options of a job on a mesh.

        Args:
            mesh: the mesh.
            options: of the job.
            topology: of the mesh, if it is known.

        Raises:
            InvalidOption: an option has no such value or means nothing here.
            InvalidMesh: the mesh cannot be encoded.
        """
        check_names(options)
        self.mesh = mesh
        self.options = options
        self.points = mesh.points
        self.message = _options.encode_options(options)
        self.metrics = _metrics(options.get("element_quality"))
        self.topology = topology or Topology.of(mesh, options)
        self.reference = self._read_reference()
        self.request_id = options.get("request_id") or str(uuid.uuid4())
        self.max_attempts = options.get("max_attempts", 4)
        timeout = options.get("timeout")
        self.timeout = (
            self._default_timeout() if timeout is None else _options.to_seconds("timeout", timeout)
        )

    def _read_reference(self) -> NDArray[Any] | None:
        reference = self.options.get("reference")
        if reference is None:
            return None
        if isinstance(reference, np.ndarray) and reference.ndim == 2:
            positions = to_wire(reference)
        else:
            other = Mesh(find_adapter(reference).read(reference))
            positions = other.points
            if not _same_elements(other.cells.blocks, self.topology.blocks):
                raise _reference_differs()
        if positions.shape != self.points.shape:
            raise _reference_differs()
        return np.ascontiguousarray(positions, self.points.dtype)

    def _default_timeout(self) -> float:
        """That of the C++ client: by the size of the mesh and the sweeps that it may take."""
        size = self.points.nbytes + sum(part.data.nbytes for part in self.topology.parts())
        sweeps = _options.default_iterations(self.options)
        return min(600 + 1e-6 * size + 10e-6 * self.topology.element_count * sweeps, _WEEK)

    def spec(self, use: TopologyUse, *, with_progress: bool) -> bytes:
        """Returns the first message of an attempt."""
        options = self.options
        spec = smoothing_pb2.JobSpec(request_id=self.request_id)
        if use.named:
            spec.topology_name = self.topology.name
        else:
            spec.inline_topology.CopyFrom(self.topology.spec())
            spec.topology_kept = use.kept
        spec.coordinate_type = (
            mesh_pb2.SCALAR_TYPE_FLOAT64
            if self.points.dtype.itemsize == 8
            else mesh_pb2.SCALAR_TYPE_FLOAT32
        )
        spec.options.CopyFrom(self.message)
        if (backend := options.get("backend", "auto")) != "auto":
            spec.backend_kind = _options.to_choice("backend", backend)
        if (priority := options.get("priority")) is not None:
            spec.priority = _options.to_choice("priority", priority)
        if (queue_timeout := options.get("queue_timeout")) is not None:
            spec.queue_timeout.CopyFrom(_options.to_duration("queue_timeout", queue_timeout))
        if (ttl := options.get("result_ttl")) is not None:
            spec.result_ttl.CopyFrom(_options.to_duration("result_ttl", ttl))
        if with_progress:
            spec.progress_interval.CopyFrom(duration_pb2.Duration(nanos=100_000_000))
        spec.iteration_history_included = bool(options.get("history", False))
        if (quality := options.get("quality")) is not None:
            spec.quality_detail = _options.to_choice("quality", quality)
        spec.element_quality_metrics.extend(self.metrics)
        return smoothing_pb2.SmoothRequest(spec=spec).SerializeToString()

    def parts(self, use: TopologyUse) -> list[_wire.Part]:
        """Returns the arrays of an attempt in the order of the wire."""
        parts = [] if use.named else list(self.topology.parts())
        parts.append(_wire.Part(_wire.COORDINATES, 0, _wire.bytes_of(self.points)))
        if self.reference is not None:
            reference = _wire.bytes_of(self.reference)
            parts.append(_wire.Part(_wire.REFERENCE_COORDINATES, 0, reference))
        return parts

    def metadata(self, use: TopologyUse) -> list[tuple[str, str]]:
        """Returns what proxies read of an attempt."""
        if not use.routed:
            return []
        return [("meshsmooth-topology", self.topology.name.rpartition("-")[2])]


def check_names(options: JobOptions) -> None:
    """Refuses keywords that are not options.

    Raises:
        TypeError: as for any other function.
    """
    for name in options:
        if name not in _KNOWN:
            raise TypeError(f"there is no option {name!r}; the options are {', '.join(_KNOWN)}")


def _same_elements(a: list[Block], b: list[Block]) -> bool:
    return len(a) == len(b) and all(
        x.element_type == y.element_type and np.array_equal(x.nodes, y.nodes)
        for x, y in itertools.zip_longest(a, b)
    )


def _reference_differs() -> InvalidMesh:
    return InvalidMesh(
        "the reference has the same elements of the same nodes, in the same order, in other "
        "positions; this one differs",
        reason="REFERENCE_DIFFERS",
        details={"field": "reference"},
    )


def _element_types(names: Sequence[str] | None) -> tuple[int, ...]:
    if names is None:
        return ()
    prefix = "ELEMENT_TYPE_"
    known = [name.removeprefix(prefix).lower() for name in mesh_pb2.ElementType.keys()[1:]]
    chosen = [names] if isinstance(names, str) else names
    for name in chosen:
        if name not in known:
            raise _options.out_of_range(
                "fixed_types", f"fixed_types has {name!r}, known are {', '.join(known)}"
            )
    return tuple(known.index(name) + 1 for name in chosen)


def _metrics(chosen: str | Sequence[str] | None) -> list[Any]:
    if chosen is None:
        return []
    names = [chosen] if isinstance(chosen, str) else chosen
    return [_options.to_choice("element_quality", name) for name in names]
