"""Memory shared with a server, from job to job."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import threading
import time
import weakref
from collections.abc import Callable

from . import _wire
from ._errors import Error
from ._region import Region, readable
from .v1 import smoothing_pb2 as pb

Lease = Callable[[int], pb.LeaseRegionResponse]

LEASE_SECONDS = 5.0
_RETRY_SECONDS = 30.0
# Small meshes go with the spec, unless there are many of them: a job in a region is one message,
# without a thread that sends, which takes a quarter off the time of a mesh of 5 nodes.
_FEW_SMALL_JOBS = 8


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
                readable(watched, None)
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
