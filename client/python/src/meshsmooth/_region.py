"""Memory shared with a server on this host, in which the arrays of jobs travel."""

from __future__ import annotations

import contextlib
import itertools
import mmap
import os
import select
import socket
import sys
import threading
import time
import weakref
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _wire
from ._errors import Error
from .v1 import smoothing_pb2 as pb

# The messages on the socket: see docs/protocol.md.
_DESCRIPTOR, _MAPPED, _READY = b"\x01", b"\x02", b"\x03"

_STEP_SECONDS = 60.0  # the server populates very large regions
_RETRY_SECONDS = 30.0
_ALIGNMENT = 64
# Small meshes go with the spec, unless there are many of them: a job in a region is one message,
# without a thread that sends, which takes a quarter off the time of a mesh of 5 nodes.
_FEW_SMALL_JOBS = 8

_NOTHING = np.empty(0, np.uint8)

Lease = Callable[[int], pb.LeaseRegionResponse]


def _readable(files: Sequence[Region | socket.socket], seconds: float | None) -> bool:
    """Waits until one is readable or closed; False when that takes too long."""
    poll = select.poll()
    for file in files:
        poll.register(file, select.POLLIN)
    return bool(poll.poll(None if seconds is None else seconds * 1000))


class Placement(NamedTuple):
    """Where the arrays of a job lie in a region.

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
        memory: of the region; arrays that lie in it stay there.
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
    return -(-offset // _ALIGNMENT) * _ALIGNMENT


class Region:
    """A region as long as its lease: until `close`, or until the server ends it."""

    def __init__(self, lease: pb.LeaseRegionResponse) -> None:
        """Fetches a region from the server's socket.

        Args:
            lease: what the server returned.

        Raises:
            OSError: it is not to be had.
        """
        self.name = lease.region_name
        self.memory: NDArray[np.uint8] = _NOTHING
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        _open.add(self)
        try:
            self._socket.connect(lease.socket_path)
            self._socket.send(lease.ticket)
            self._await()
            message, files, _, _ = socket.recv_fds(self._socket, 1, 1)
            try:
                if message != _DESCRIPTOR or os.fstat(files[0]).st_size != lease.size_bytes:
                    raise OSError("not the region that was leased")
                flags = mmap.MAP_SHARED | getattr(mmap, "MAP_POPULATE", 0x8000)
                memory = mmap.mmap(files[0], lease.size_bytes, flags=flags)
            finally:
                for file in files:
                    os.close(file)
            self.memory = np.frombuffer(memory, np.uint8)
            self._socket.send(_MAPPED)
            self._await()
            if self._socket.recv(1) != _READY:
                raise OSError("the server did not share the region")
            self._socket.setblocking(False)
        except BaseException:
            self.close()
            raise

    def _await(self) -> None:
        if not _readable([self._socket], _STEP_SECONDS):
            raise OSError("the server did not answer")

    def fileno(self) -> int:
        """The socket, which becomes readable when the region is lost or wanted back."""
        return self._socket.fileno()

    def ended(self) -> bool:
        """Whether the region is lost or wanted back."""
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

    def fill(self, parts: list[_wire.Part], placement: Placement) -> None:
        """Copies the arrays to their places, unless they lie there."""
        for part, begin in zip(_with_bytes(parts), placement.begins, strict=True):
            if _offset_in(self.memory, part.data) is None:
                _wire.copy_to(self.memory[begin : begin + part.data.nbytes], part.data)


class Held:
    """The region in which a session's positions lie, if they do.

    Attributes:
        region: None: they lie elsewhere.
        kept: its bytes that they take, from and to.
    """

    def __init__(self) -> None:
        self.region: Region | None = None
        self.kept = (0, 0)

    def take(self, region: Region, begin: int, size: int) -> None:
        """Holds a region from now on."""
        self.region, self.kept = region, (begin, begin + size)

    def close(self) -> None:
        """Ends the lease; the positions stay as long as somebody has them."""
        if self.region is not None:
            self.region.close()
        self.region, self.kept = None, (0, 0)


_open: weakref.WeakSet[Region] = weakref.WeakSet()


def _forget_after_fork() -> None:
    # A lease that the child holds too would not end with the parent, nor would its memory be free.
    for region in list(_open):
        region.close()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_after_fork)


class RegionPool:
    """Regions kept from job to job, made by a thread while the first job goes in chunks.

    As in the C++ client: making one takes longer than sending a mesh. Never fails: where there is
    no shared memory there are no regions. Thread-safe.
    """

    def __init__(self, lease: Lease) -> None:
        """Prepares for the regions of a server.

        Args:
            lease: the call LeaseRegion.
        """
        self._lease = lease
        self._lock = threading.Lock()
        self._idle: list[Region] = []
        self._watched: list[Region] = []  # by the thread, until it is woken
        self._wanted_bytes = 0
        self._small_jobs = 0
        self._next_try = 0.0
        self._closed = False
        self._thread: threading.Thread | None = None
        self._pid = os.getpid()

    @classmethod
    def at(cls, address: str, lease: Lease, owner: object) -> RegionPool | None:
        """Returns a pool that ends with its owner; None: that server shares no memory with us."""
        if not address.startswith("unix:") or sys.platform != "linux":
            return None
        pool = cls(lease)
        weakref.finalize(owner, pool.close)
        return pool

    def borrow(self, size: int) -> Region | None:
        """Returns a region of so many bytes; None if there is none now, and has one made."""
        with self._lock:
            if size < _wire.SMALL_BYTES and self._small_jobs < _FEW_SMALL_JOBS:
                self._small_jobs += 1
                return None
            if self._closed or self._pid != os.getpid():
                return None
            self._drop_ended()
            for region in self._idle:
                if region.memory.nbytes >= size:
                    self._idle.remove(region)
                    return region
            while self._idle:  # too small: a larger one takes their place
                self._idle.pop().close()
            if time.monotonic() >= self._next_try:
                self._wanted_bytes = max(self._wanted_bytes, size + size // 8)
                self._wake()
            return None

    def give_back(self, region: Region) -> None:
        """Keeps a region for the next job; one whose job did not end well must be closed."""
        with self._lock:
            if self._closed or region.ended():
                region.close()
                return
            self._idle.append(region)
            if region not in self._watched:
                self._wake()

    def close(self) -> None:
        """Ends all leases."""
        with self._lock:
            self._closed = True
            if self._pid != os.getpid():
                return
            for region in self._idle:
                region.close()
            self._idle.clear()
            if self._thread is not None:
                self._waker.send(b"x")

    def _wake(self) -> None:
        if self._thread is None:
            self._waker, self._sleeper = socket.socketpair()
            self._sleeper.setblocking(False)
            # Not joined: what it waits for may take seconds.
            self._thread = threading.Thread(target=self._run, name="regions", daemon=True)
            self._thread.start()
        self._waker.send(b"x")

    def _drop_ended(self) -> None:
        for region in [region for region in self._idle if region.ended()]:
            self._idle.remove(region)
            region.close()

    def _run(self) -> None:
        while True:
            with self._lock:
                if self._closed:
                    return
                self._drop_ended()
                wanted = self._wanted_bytes
                # Also while a job has them, so that not each job wakes this thread.
                self._watched = list(self._idle)
                watched: list[Region | socket.socket] = [self._sleeper, *self._watched]
            if wanted:
                self._make(wanted)
                continue
            with contextlib.suppress(OSError, ValueError):  # one of them was closed meanwhile
                _readable(watched, None)
            with contextlib.suppress(BlockingIOError):
                self._sleeper.recv(64)

    def _make(self, size: int) -> None:
        region = None
        with contextlib.suppress(Error, OSError, ValueError):
            region = Region(self._lease(size))
        with self._lock:
            self._wanted_bytes = 0
            if region is None:
                self._next_try = time.monotonic() + _RETRY_SECONDS
            elif self._closed:
                region.close()
            else:
                self._idle.append(region)
