"""The arrays of a result, as they come."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _wire
from ._errors import InvalidMesh, InvalidOption
from ._request import Request
from ._service_error import broken_answer
from .v1 import smoothing_pb2


class Result:
    """The arrays of a result, filled chunk by chunk; chunks may come over several calls."""

    def __init__(
        self, request: Request, memory: NDArray[Any] | None = None, *, attached: bool = False
    ) -> None:
        """Prepares for the result of a request.

        Args:
            request: of the job.
            memory: where the positions are written, of their shape and type; None: new memory.
            attached: the job was sent before, as the caller says with this mesh.
        """
        self._attached = attached
        self._request = request
        self._positions = memory
        self.in_place = False  # no chunks come: the arrays are in place when the summary comes
        self._quality = np.empty((0, 0), np.float32)
        self._metrics: list[int] = []
        self._arrays: list[tuple[int, memoryview]] = []  # of the result, in order
        self.size_bytes = 0
        self.received_bytes = 0
        self.begun = False
        self.summary: smoothing_pb2.Summary | None = None

    def begin(self, header: smoothing_pb2.ResultHeader) -> None:
        """Takes the announcement of the arrays."""
        if self.begun:
            raise broken_answer("the server announced its result twice")
        points = self._request.points
        scalar = 2 if points.dtype.itemsize == 8 else 1  # SCALAR_TYPE_FLOAT64, _FLOAT32
        if header.node_count != len(points) or header.coordinate_type != scalar:
            if self._attached:
                raise InvalidMesh(
                    f"the job has a result of {header.node_count} nodes in scalar type "
                    f"{header.coordinate_type}, the mesh has {len(points)} nodes in "
                    f"{points.dtype}: it is not the mesh that was sent",
                    reason="ARRAY_SIZE_MISMATCH",
                )
            raise broken_answer(
                f"the server announced a result of {header.node_count} nodes in scalar type "
                f"{header.coordinate_type} for {len(points)} nodes in {points.dtype}"
            )
        self._metrics = list(header.element_quality_metrics)
        if self._metrics != self._request.metrics:
            raise InvalidOption(
                "the server does not return the element_quality that was asked for; a server that "
                "can has the feature element_quality",
                reason="OPTION_NOT_SUPPORTED",
                details={"field": "element_quality_metrics"},
            )
        self.in_place = header.in_place
        if self._positions is None and not self.in_place:
            self._positions = np.empty(points.shape, points.dtype)
        shape = (len(self._metrics), self._request.topology.element_count)
        self._quality = np.empty(shape, np.dtype("<f4"))
        if self._positions is not None:
            self._arrays = [(_wire.COORDINATES, _wire.bytes_of(self._positions))]
        if self._metrics:
            self._arrays.append((_wire.ELEMENT_QUALITY, _wire.bytes_of(self._quality)))
        self.size_bytes = points.nbytes + self._quality.nbytes
        if header.size_bytes != self.size_bytes:
            raise broken_answer(
                f"the server announced a result of {header.size_bytes} bytes, it must have "
                f"{self.size_bytes}"
            )
        self.begun = True

    def add(self, chunk: _wire.Chunk) -> None:
        """Copies a chunk to its place."""
        due, memory, offset_bytes = self._due()
        if chunk.array_id != due or chunk.offset_bytes != offset_bytes:
            raise broken_answer(
                f"the server sent result bytes at {chunk.offset_bytes} where those at "
                f"{offset_bytes} were due"
            )
        end = offset_bytes + chunk.data.nbytes
        if end > memory.nbytes:
            raise broken_answer(
                f"the server sent more result bytes than the {self.size_bytes} announced"
            )
        if not chunk.has_right_checksum():
            raise broken_answer(
                f"the checksum of the result bytes at {self.received_bytes} is wrong"
            )
        memory[offset_bytes:end] = chunk.data
        self.received_bytes += chunk.data.nbytes

    def find(self, memory: NDArray[np.uint8]) -> None:
        """Takes all arrays, which lie one after the other; the positions stay there."""
        points = self._request.points
        self._positions = memory[: points.nbytes].view(points.dtype).reshape(points.shape)
        quality = memory[points.nbytes : self.size_bytes]
        self._quality[...] = quality.view(self._quality.dtype).reshape(self._quality.shape)
        self.received_bytes = self.size_bytes

    def _due(self) -> tuple[int, memoryview, int]:
        """The array that the next byte belongs to, and its offset there."""
        offset_bytes = self.received_bytes
        for array_id, memory in self._arrays:
            if offset_bytes < memory.nbytes:
                return array_id, memory, offset_bytes
            offset_bytes -= memory.nbytes
        return _wire.COORDINATES, memoryview(b""), self.received_bytes

    def take(self) -> tuple[NDArray[Any], NDArray[np.float32], smoothing_pb2.Summary]:
        """Returns positions, quality of each element by metric, and the summary."""
        if self.summary is None:
            raise broken_answer("the server ended the call without a summary")
        if self._positions is None or self.received_bytes != self.size_bytes:
            raise broken_answer(
                f"the result is incomplete: {self.received_bytes} of {self.size_bytes} bytes "
                "arrived"
            )
        return self._positions, self._quality, self.summary
