"""A job as it is asked for: what every attempt at it sends."""

from __future__ import annotations

import functools
import hashlib
import uuid
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from google.protobuf import duration_pb2
from numpy.typing import NDArray

from . import _options, _wire
from ._adapters import is_mesh, read_mesh
from ._arrays import as_coordinates
from ._cell_types import BY_NAME, TYPES
from ._cells import Block
from ._coincident import find_representatives, merged, merged_blocks, merged_mask
from ._errors import InvalidMesh, misplaced, out_of_range
from ._job_options import JobOptions
from ._mesh import (
    Mesh,
    fixed_mask,
    inner_mask,
    lower_dimensional_mask,
    to_wire,
)
from ._periodic import node_pairs
from ._regions import element_regions
from .v1 import mesh_pb2, smoothing_pb2

_WEEK = 7 * 24 * 3600.0


class Prescribed(NamedTuple):
    """Nodes of a mesh, each once, and where they shall lie."""

    nodes: NDArray[np.int32]
    positions: NDArray[Any]  # [nodes, 3], in the type of the mesh's


class Topology:
    """A mesh without its positions: elements, fixed nodes, regions.

    Attributes:
        fixed: 1 for each node that the caller fixed; None: no node.
        mask: 1 for each of these and of the nodes that cells of lower dimension hold, likewise.
        reference: positions that are kept with it; None: it has none.
        representatives: the node that stands for each at its position; None: each for itself.
    """

    def __init__(
        self,
        node_count: int,
        blocks: list[Block],
        fixed: NDArray[np.uint8] | None,
        held: NDArray[np.uint8] | None,
        regions: NDArray[np.int32] | None,
        reference: NDArray[Any] | None = None,
        representatives: NDArray[np.int64] | None = None,
    ) -> None:
        self.node_count = node_count
        self.blocks = blocks
        self.fixed = fixed
        self._held = held
        self.mask = held if fixed is None else fixed if held is None else fixed | held
        self.regions = regions
        self.reference = reference
        self.representatives = representatives

    @classmethod
    def of(cls, mesh: Mesh, options: JobOptions) -> Topology:
        """Returns the topology of a mesh with those of the options that belong to it."""
        boundary = options.get("boundary") or "fixed"
        _options.encode_options({"boundary": boundary})  # refuses other values
        regions = element_regions(mesh, options.get("regions", "auto"), boundary == "free")
        # Where the boundary may move, its cells of lower dimension follow its nodes; those inside
        # would drift.
        held = lower_dimensional_mask(mesh) if boundary == "fixed" else inner_mask(mesh, regions)
        fixed = fixed_mask(mesh, options.get("fixed"), _element_types(options.get("fixed_types")))
        blocks = mesh.cells.blocks
        if not options.get("merge_coincident"):
            return cls(mesh.node_count, blocks, fixed, held, regions)
        of = find_representatives(mesh.points)
        return cls(
            mesh.node_count,
            merged_blocks(blocks, of),
            merged_mask(fixed, of),
            merged_mask(held, of),
            regions,
            representatives=of,
        )

    def moving(self, reference: NDArray[Any], nodes: NDArray[np.int32]) -> Topology:
        """Returns the topology of a job that moves nodes of a reference.

        Cells of lower dimension do not hold these nodes.
        """
        held = self._held
        if held is not None:
            held = held.copy()
            held[nodes] = 0
        return Topology(
            self.node_count,
            self.blocks,
            self.fixed,
            held,
            self.regions,
            reference,
            self.representatives,
        )

    def holds_those_of(self, other: Topology) -> bool:
        """Returns whether the same nodes are fixed or held."""
        if self.mask is None or other.mask is None:
            return self.mask is other.mask
        return np.array_equal(self.mask, other.mask)

    def counts_from_one(self) -> bool:
        """Returns whether the nodes of the elements seem to be numbered from 1."""
        least = min(int(block.nodes.min()) for block in self.blocks)
        most = max(int(block.nodes.max()) for block in self.blocks)
        return least >= 1 and most == self.node_count

    @property
    def element_count(self) -> int:
        """The number of elements."""
        return sum(block.element_count for block in self.blocks)

    def spec(self) -> mesh_pb2.TopologySpec:
        """Returns the announcement of the arrays."""
        spec = mesh_pb2.TopologySpec(
            node_count=self.node_count,
            fixed_mask_present=self.mask is not None,
            element_regions_present=self.regions is not None,
        )
        if self.reference is not None:
            spec.reference_type = _scalar_type(self.reference)
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
        if self.mask is not None:
            yield _wire.Part(_wire.FIXED_MASK, 0, _wire.bytes_of(self.mask))
        if self.regions is not None:
            yield _wire.Part(_wire.ELEMENT_REGIONS, 0, _wire.bytes_of(self.regions))
        if self.reference is not None:
            yield _wire.Part(_wire.REFERENCE_COORDINATES, 0, _wire.bytes_of(self.reference))

    @functools.cached_property
    def name(self) -> str:
        """The server's name of the topology, "topologies/sha256-…"; hashed at first use."""
        numbers = [self.node_count, len(self.blocks)]
        for block in self.blocks:
            numbers += [block.element_type, block.element_count]
        numbers += [int(self.mask is not None), int(self.regions is not None)]
        if self.reference is not None:
            numbers.append(_scalar_type(self.reference))
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
        _options.check_names(options)
        self.mesh = mesh
        self.options = options
        self.points = mesh.points
        self.message = _options.encode_options(options)
        self.prescribed = prescribed
        if self.message.HasField("move") and prescribed is None:
            raise misplaced("method", 'method="move" is that of move(…), not of smooth(…)')
        self.metrics: list[Any] = _options.to_metrics(options.get("element_quality"))
        self.topology = topology or Topology.of(mesh, options)
        self.reference = self._read_reference()
        self.node_pairs = node_pairs(mesh, options)
        of = self.topology.representatives
        if self.node_pairs is not None and of is not None:
            self.node_pairs = np.ascontiguousarray(merged(self.node_pairs, of), np.dtype("<i4"))
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
        return other_positions(self.mesh, reference, "reference")

    def _default_timeout(self) -> float:
        """As the C++ client: by the size of what may travel and the sweeps that it may take."""
        size = sum(part.data.nbytes for part in self.parts(TopologyUse()))
        sweeps = _options.default_iterations(self.options)
        return min(600 + 1e-6 * size + 10e-6 * self.topology.element_count * sweeps, _WEEK)

    def spec(self, use: TopologyUse, *, with_progress: bool) -> bytes:
        """Returns the first message of an attempt."""
        spec = smoothing_pb2.JobSpec(request_id=self.request_id)
        if use.named:
            spec.topology_name = self.topology.name
        else:
            spec.inline_topology.CopyFrom(self.topology.spec())
            spec.topology_kept = use.kept
        spec.coordinate_type = _scalar_type(self.points)
        if self.prescribed is not None:
            spec.prescribed_node_count = len(self.prescribed.nodes)
        if self.node_pairs is not None:
            spec.node_pair_count = len(self.node_pairs)
        spec.options.CopyFrom(self.message)
        _options.encode_job(self.options, spec)
        if with_progress:
            spec.progress_interval.CopyFrom(duration_pb2.Duration(nanos=100_000_000))
        spec.element_quality_metrics.extend(self.metrics)
        return smoothing_pb2.SmoothRequest(spec=spec).SerializeToString()

    def parts(self, use: TopologyUse) -> list[_wire.Part]:
        """Returns the arrays of an attempt in the order of the wire."""
        parts = [] if use.named else list(self.topology.parts())
        own: list[tuple[int, NDArray[Any]]]
        if self.prescribed is not None:
            own = [
                (_wire.PRESCRIBED_NODES, self.prescribed.nodes),
                (_wire.PRESCRIBED_COORDINATES, self.prescribed.positions),
            ]
        else:
            own = [(_wire.COORDINATES, self.points)]
            if self.reference is not None:
                own.append((_wire.REFERENCE_COORDINATES, self.reference))
        if self.node_pairs is not None:
            own.append((_wire.NODE_PAIRS, self.node_pairs))
        return parts + [_wire.Part(array_id, 0, _wire.bytes_of(array)) for array_id, array in own]

    @property
    def result_bytes(self) -> int:
        """The size of the arrays of the result."""
        return self.points.nbytes + 4 * len(self.metrics) * self.topology.element_count

    def metadata(self, use: TopologyUse) -> list[tuple[str, str]]:
        """Returns what proxies read of an attempt."""
        if not use.routed:
            return []
        return [("meshsmooth-topology", self.topology.name.rpartition("-")[2])]


def _scalar_type(positions: NDArray[Any]) -> mesh_pb2.ScalarType:
    wide = positions.dtype.itemsize == 8
    return mesh_pb2.SCALAR_TYPE_FLOAT64 if wide else mesh_pb2.SCALAR_TYPE_FLOAT32


def other_positions(mesh: Mesh, given: Any, field: str) -> NDArray[Any]:
    """Returns other positions of a mesh, [nodes, 3] in its type, as an option gives them.

    Args:
        mesh: the mesh.
        given: an array of positions, or a mesh with the same elements.
        field: the option, for errors.
    """
    if not is_mesh(given):
        positions = to_wire(as_coordinates(given, field), mesh.width)
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


def _element_types(names: Sequence[str] | None) -> tuple[int, ...]:
    chosen = [names] if isinstance(names, str) else names or ()
    found = []
    for name in chosen:
        kind = BY_NAME.get(name) or _WIRE_TYPES.get(name)
        if kind is None or not kind.element:
            known = ", ".join(kind.name for kind in TYPES if kind.element)
            raise out_of_range("fixed_types", f"fixed_types has {name!r}, known are {known}")
        found.append(kind.element)
    return tuple(found)


# As the command line and errors call them.
_WIRE_TYPES = {
    mesh_pb2.ElementType.Name(kind.element).removeprefix("ELEMENT_TYPE_").lower(): kind
    for kind in TYPES
    if kind.element
}
