"""The transport of a client: memory shared with its server, from job to job."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import threading
import time
import weakref
from collections.abc import Callable
from typing import Any

from . import _rpc, _wire
from ._errors import Error
from ._shared_memory import Segment, readable
from ._transfer import Transfer, Transport

# Calls a method with the fields of its request.
Run = Callable[..., Any]

CALL_SECONDS = 5.0  # at most, of a call of the transport
_RETRY_SECONDS = 30.0
# Small meshes go with the spec, unless there are many of them: a job in a segment is one message,
# without a thread that sends, which takes a quarter off the time of a mesh of 5 nodes.
_FEW_SMALL_JOBS = 8


class SegmentPool(Transport):
    """Segments kept from job to job, made by a thread while the first job goes in chunks.

    As in the C++ client: making one takes longer than sending a mesh. Never fails: where there is
    no shared memory there are no segments. Thread-safe.
    """

    def __init__(self, run: Run) -> None:
        """Prepares for the segments of a server.

        Args:
            run: makes calls to it, by the thread that makes segments.
        """
        self._run_call = run
        self._lock = threading.Lock()
        self._idle: list[Segment] = []
        self._watched: list[Segment] = []  # by the thread, until it is woken
        self._wanted_bytes = 0
        self._small_jobs = 0
        self._next_try = 0.0
        self._closed = False
        self._thread: threading.Thread | None = None
        self._pid = os.getpid()

    def open(self, size: int) -> Segment | None:
        """See `Transport`."""
        with self._lock:
            if size < _wire.SMALL_BYTES and self._small_jobs < _FEW_SMALL_JOBS:
                self._small_jobs += 1
                return None
            if self._closed or self._pid != os.getpid():
                return None
            self._drop_ended()
            for segment in self._idle:
                if segment.memory.nbytes >= size:
                    self._idle.remove(segment)
                    return segment
            while self._idle:  # too small: a larger one takes their place
                self._idle.pop().close()
            if time.monotonic() >= self._next_try:
                self._wanted_bytes = max(self._wanted_bytes, size + size // 8)
                self._wake()
            return None

    def give_back(self, transfer: Transfer) -> None:
        """See `Transport`."""
        assert isinstance(transfer, Segment)
        with self._lock:
            if self._closed or transfer.ended():
                transfer.close()
                return
            self._idle.append(transfer)
            if transfer not in self._watched:
                self._wake()

    def refused(self, error: Error) -> bool:
        """See `Transport`."""
        field = str(error.details.get("field", ""))
        return error.reason.startswith("SHARED_MEMORY_") or field.startswith("shared_memory")

    def close(self) -> None:
        """Ends all leases."""
        with self._lock:
            self._closed = True
            if self._pid != os.getpid():
                return
            for segment in self._idle:
                segment.close()
            self._idle.clear()
            if self._thread is not None:
                self._waker.send(b"x")

    def _wake(self) -> None:
        if self._thread is None:
            self._waker, self._sleeper = socket.socketpair()
            self._sleeper.setblocking(False)
            # Not joined: what it waits for may take seconds.
            self._thread = threading.Thread(target=self._run, name="segments", daemon=True)
            self._thread.start()
        self._waker.send(b"x")

    def _drop_ended(self) -> None:
        for segment in [segment for segment in self._idle if segment.ended()]:
            self._idle.remove(segment)
            segment.close()

    def _run(self) -> None:
        while True:
            with self._lock:
                if self._closed:
                    return
                self._drop_ended()
                wanted = self._wanted_bytes
                # Also while a job has them, so that not each job wakes this thread.
                self._watched = list(self._idle)
                watched: list[Segment | socket.socket] = [self._sleeper, *self._watched]
            if wanted:
                self._make(wanted)
                continue
            with contextlib.suppress(OSError, ValueError):  # one of them was closed meanwhile
                readable(watched, None)
            with contextlib.suppress(BlockingIOError):
                self._sleeper.recv(64)

    def _make(self, size: int) -> None:
        segment = None
        with contextlib.suppress(Error, OSError, ValueError):
            segment = Segment(
                self._run_call(_rpc.LEASE_SHARED_MEMORY, CALL_SECONDS, size_bytes=size)
            )
        with self._lock:
            self._wanted_bytes = 0
            if segment is None:
                self._next_try = time.monotonic() + _RETRY_SECONDS
            elif self._closed:
                segment.close()
            else:
                self._idle.append(segment)


def make_transport(address: str, run: Run, owner: object) -> Transport | None:
    """Returns a transport that ends with its owner; None: all arrays go in messages.

    Args:
        address: of the server.
        run: makes calls to it, from any thread, and does not keep the owner alive.
        owner: the connection.
    """
    if not address.startswith("unix:") or sys.platform != "linux":
        return None
    pool = SegmentPool(run)
    weakref.finalize(owner, pool.close)
    return pool
