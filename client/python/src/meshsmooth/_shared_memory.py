"""Memory shared with a server on this host, in which the arrays of jobs travel."""

from __future__ import annotations

import itertools
import mmap
import os
import select
import socket
import weakref
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _wire
from ._transfer import ALIGNMENT, Transfer
from .v1 import smoothing_pb2 as pb

# The messages on the socket: see docs/protocol.md.
_DESCRIPTOR, _MAPPED, _READY = b"\x01", b"\x02", b"\x03"

_STEP_SECONDS = 60.0  # the server populates very large segments
_NOTHING = np.empty(0, np.uint8)


def readable(files: Sequence[Segment | socket.socket], seconds: float | None) -> bool:
    """Waits until one is readable or closed; returns False when that takes too long."""
    poll = select.poll()
    for file in files:
        poll.register(file, select.POLLIN)
    return bool(poll.poll(None if seconds is None else seconds * 1000))


class Placement(NamedTuple):
    """Where the arrays of a job lie in a segment.

    Attributes:
        inputs: array and offset of each.
        begins: of each part that has bytes.
        result_offset: of the result.
        size: the bytes of it all.
    """

    inputs: list[tuple[int, int]]
    begins: list[int]
    result_offset: int
    size: int


def place(
    parts: list[_wire.Part],
    result_bytes: int,
    memory: NDArray[np.uint8] = _NOTHING,
    kept: tuple[int, int] = (0, 0),
) -> Placement:
    """Returns where the arrays go, contiguously.

    Args:
        parts: of the arrays; those of one array follow without a gap.
        result_bytes: of the result.
        memory: of the segment; arrays that lie in it stay there.
        kept: bytes of it, from and to, that are not written to.
    """
    inputs: list[tuple[int, int]] = []
    begins: list[int] = []
    end = 0

    def free(size: int) -> int:
        nonlocal end
        begin = _aligned(end)
        if begin < kept[1] and begin + size > kept[0]:
            begin = _aligned(kept[1])
        end = begin + size
        return begin

    parts = _with_bytes(parts)
    for first, part in enumerate(parts):
        if part.offset_bytes == 0:
            following = itertools.takewhile(lambda p: p.offset_bytes > 0, parts[first + 1 :])
            inside = _offset_in(memory, part.data)
            size = part.data.nbytes + sum(p.data.nbytes for p in following)
            begin = free(size) if inside is None else inside
            inputs.append((part.array_id, begin))
        begins.append(begin)
        begin += part.data.nbytes
    result_offset = free(result_bytes)
    return Placement(inputs, begins, result_offset, end)


def _with_bytes(parts: list[_wire.Part]) -> list[_wire.Part]:
    return [part for part in parts if part.data.nbytes]


def _offset_in(memory: NDArray[np.uint8], data: _wire.Data) -> int | None:
    if isinstance(data, _wire.Int32View):
        return None
    offset = int(np.frombuffer(data, np.uint8).ctypes.data - memory.ctypes.data)
    return offset if 0 <= offset < memory.nbytes else None


def _aligned(offset: int) -> int:
    return -(-offset // ALIGNMENT) * ALIGNMENT


class Segment(Transfer):
    """Shared memory as long as its lease: until `close`, or until the server ends it."""

    def __init__(self, lease: pb.LeaseSharedMemoryResponse) -> None:
        """Fetches a segment from the server's socket.

        Args:
            lease: what the server returned.

        Raises:
            OSError: it is not to be had.
        """
        self.name = lease.segment_name
        self.memory: NDArray[np.uint8] = _NOTHING
        self._result_offset = 0
        self._held = (0, 0)  # bytes that are not written to, from and to
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        _open.add(self)
        try:
            self._socket.connect(lease.socket_path)
            self._socket.send(lease.ticket)
            self._await()
            message, files, _, _ = socket.recv_fds(self._socket, 1, 1)
            try:
                if message != _DESCRIPTOR or os.fstat(files[0]).st_size != lease.size_bytes:
                    raise OSError("not the memory that was leased")
                flags = mmap.MAP_SHARED | getattr(mmap, "MAP_POPULATE", 0x8000)
                memory = mmap.mmap(files[0], lease.size_bytes, flags=flags)
            finally:
                for file in files:
                    os.close(file)
            self.memory = np.frombuffer(memory, np.uint8)
            self._socket.send(_MAPPED)
            self._await()
            if self._socket.recv(1) != _READY:
                raise OSError("the server did not share its memory")
            self._socket.setblocking(False)
        except BaseException:
            self.close()
            raise

    def _await(self) -> None:
        if not readable([self._socket], _STEP_SECONDS):
            raise OSError("the server did not answer")

    def fileno(self) -> int:
        """The socket, which becomes readable when the segment is lost or recalled."""
        return self._socket.fileno()

    def ended(self) -> bool:
        """Whether the segment is lost or recalled."""
        try:
            self._socket.recv(1)
        except BlockingIOError:
            return False
        except OSError:
            pass
        return True

    def close(self) -> None:
        """Ends the lease; the memory is unmapped with the last array that lies in it."""
        self._socket.close()
        self.memory = _NOTHING
        _open.discard(self)

    def upload(self, parts: list[_wire.Part], result_bytes: int, spec: pb.JobSpec) -> bool:
        """See `Transfer`."""
        placement = place(parts, result_bytes, self.memory, self._held)
        if placement.size > self.memory.nbytes:
            return False
        for part, begin in zip(_with_bytes(parts), placement.begins, strict=True):
            if _offset_in(self.memory, part.data) is None:
                _wire.copy_to(self.memory[begin : begin + part.data.nbytes], part.data)
        use = spec.shared_memory
        use.segment_name = self.name
        for array_id, offset in placement.inputs:
            use.inputs.add(array_id=array_id, offset_bytes=offset)
        use.result_offset_bytes = self._result_offset = placement.result_offset
        return True

    def download(self) -> NDArray[np.uint8]:
        """See `Transfer`."""
        return self.memory[self._result_offset :]

    def hold(self, size: int) -> None:
        """See `Transfer`."""
        self._held = (self._result_offset, self._result_offset + size)


_open: weakref.WeakSet[Segment] = weakref.WeakSet()


def _forget_after_fork() -> None:
    # A lease that the child holds too would not end with the parent, nor would its memory be free.
    for segment in list(_open):
        segment.close()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_after_fork)
