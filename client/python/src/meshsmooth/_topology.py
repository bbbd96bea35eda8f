"""A mesh without its positions, as it travels and as the server keeps it."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _options, _wire
from ._cell_types import BY_NAME, TYPES
from ._cells import Block
from ._coincident import find_representatives, merged_blocks, merged_mask
from ._errors import out_of_range
from ._job_options import JobOptions
from ._mesh import Mesh, fixed_mask, inner_mask, lower_dimensional_mask
from ._regions import element_regions
from .v1 import mesh_pb2


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
        if boundary != "fixed":
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
            spec.reference_type = scalar_type(self.reference)
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
            numbers.append(scalar_type(self.reference))
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


def scalar_type(positions: NDArray[Any]) -> mesh_pb2.ScalarType:
    """Returns the type of positions as it is announced."""
    wide = positions.dtype.itemsize == 8
    return mesh_pb2.SCALAR_TYPE_FLOAT64 if wide else mesh_pb2.SCALAR_TYPE_FLOAT32


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
