"""The blocking connection to a server."""

from __future__ import annotations

import os
import threading
import weakref
from collections.abc import Iterator
from typing import Any, Generic, TypeVar

import grpc

from . import _channel, _rpc
from ._calls import Calls
from ._control import Control
from ._fork_guard import fork_guard
from ._machine import RECEIVE, Action, Ask, Begin, Failed, Machine, Steps, Wait
from ._transport import Run, make_transport
from ._wire import Upload

R = TypeVar("R")


def _running(connection: weakref.ref[Connection]) -> Run:
    """Makes calls of one message each way, and does not keep its connection alive."""

    def run(method: _rpc.Unary[R], timeout: float, **fields: Any) -> R:
        alive = connection()
        if alive is None:
            raise OSError("the connection is gone")
        return alive.run(alive.calls.ask(method, timeout, **fields))

    return run


class Connection:
    """A channel to a server, opened by the first call; performs the steps of calls. Thread-safe.

    Attributes:
        endpoint: the server and what it needs to know of its caller.
        calls: to it.
    """

    def __init__(self, endpoint: _channel.Endpoint) -> None:
        self.endpoint = endpoint
        self._lock = threading.Lock()
        self._channel: Any = None
        self._channel_address = ""
        self._pid = 0  # of the process that the channel belongs to
        self._closed = False
        self._transport = make_transport(endpoint.address, _running(weakref.ref(self)), self)
        self.calls = Calls(endpoint, self._transport)

    def close(self) -> None:
        """Closes the channel; calls under way end with `Cancelled`."""
        if self._transport is not None:
            self._transport.close()
        with self._lock:
            self._closed = True
            channel, self._channel = self._channel, None
            if channel is not None and self._pid == os.getpid():
                channel.close()

    def open_channel(self) -> tuple[Any, str]:
        """Returns the channel and the address that it leads to."""
        fork_guard.check()
        with self._lock:
            if self._closed:
                raise ValueError("the client is closed")
            address = self.endpoint.address
            own = self._pid == os.getpid()
            # The channel to a local server that has ended is dropped, not closed: its calls end
            # with their own errors.
            if self._channel is None or not own or address != self._channel_address:
                self._channel = _channel.open_channel(grpc, address, self.endpoint.tls)
                self._channel_address, self._pid = address, os.getpid()
            return self._channel, address

    def run(self, steps: Steps[R], control: Control | None = None) -> R:
        """Performs the steps of a call and returns its result."""
        return Running(self, steps, control or Control()).result()


class Running(Generic[R]):
    """A call under way on a connection."""

    def __init__(self, connection: Connection, steps: Steps[R], control: Control) -> None:
        self._connection = connection
        self._control = control
        self._answers: Any = None
        self._server = ""  # of the answers
        self._wake = threading.Event()  # the upload may continue
        self._machine = Machine(steps)

    def begin(self) -> None:
        """Performs all steps up to the first answer, and does not wait for that."""
        while self._machine.action not in (None, RECEIVE):
            self._step()

    def result(self) -> R:
        """Performs all steps."""
        try:
            while self._machine.action is not None:
                self._step()
            return self._machine.result
        except BaseException:
            if self._answers is not None:
                self._answers.cancel()
            raise
        finally:
            self._control.arm(None)

    def _step(self) -> None:
        try:
            event = self._perform(self._machine.action)
        except BaseException as error:
            self._machine.fail(error)
        else:
            self._machine.feed(event)

    def _perform(self, action: Action | None) -> Any:
        if action is RECEIVE:
            return self._receive()
        if isinstance(action, Begin):
            return self._begin(action)
        if isinstance(action, Wait):
            stop = threading.Event()
            self._control.arm(stop.set)
            stop.wait(action.seconds)
        if isinstance(action, Ask):
            return self._ask(action)
        return None

    def _ask(self, action: Ask) -> Any:
        channel, server = self._connection.open_channel()
        try:
            return _channel.ask(channel, action, self._connection.endpoint.metadata())
        except grpc.RpcError as status:
            return Failed(status, server)  # type: ignore[arg-type]

    def _begin(self, action: Begin) -> None:
        if self._answers is not None:
            self._answers.cancel()  # broken off in their midst
        channel, self._server = self._connection.open_channel()
        ended = threading.Event()
        messages = None
        if action.upload is not None:
            messages = self._messages(action.first, action.upload, ended)
        metadata = self._connection.endpoint.metadata()
        self._answers = _channel.begin(channel, action, messages, metadata)
        if messages is not None:

            def end() -> None:
                ended.set()
                self._wake.set()

            if not self._answers.add_callback(end):
                end()
        self._control.arm(self._answers.cancel)

    def _messages(self, first: bytes, upload: Upload, ended: threading.Event) -> Iterator[bytes]:
        """The messages of a call, which gRPC takes in a thread of its own."""
        yield first
        while not ended.is_set():
            yield from upload.chunks()
            if upload.complete:
                return
            self._wake.wait()
            self._wake.clear()

    def _receive(self) -> bytes | Failed | None:
        self._wake.set()  # the last answer may have allowed more
        try:
            answer: bytes | None = next(self._answers, None)
        except grpc.RpcError as status:
            return Failed(status, self._server)  # type: ignore[arg-type]
        return answer
