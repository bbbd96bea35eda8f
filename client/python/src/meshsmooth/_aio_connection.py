"""The connection to a server on asyncio."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import functools
import weakref
from collections.abc import AsyncIterator, Coroutine
from typing import Any, TypeVar

import grpc.aio

from . import _channel, _rpc
from ._calls import Calls
from ._control import Control
from ._fork_guard import fork_guard
from ._machine import RECEIVE, Action, Ask, Begin, Failed, Machine, Steps, Wait
from ._transport import Run, make_transport
from ._wire import Upload

R = TypeVar("R")

# What gRPC sets as the status when a message could not be sent, over that of the server or before.
_UNSENT = "Internal error from Core"


def _running(connection: weakref.ref[AsyncConnection]) -> Run:
    """Makes calls from another thread, and does not keep its connection alive."""

    def run(method: _rpc.Unary[R], timeout: float, **fields: Any) -> R:
        alive = connection()
        if alive is None or alive.loop is None:
            raise OSError("the connection is gone")
        call = alive.run(alive.calls.ask(method, timeout, **fields))
        try:
            answer = asyncio.run_coroutine_threadsafe(call, alive.loop)
        except RuntimeError:
            call.close()
            raise OSError("the event loop has ended") from None
        try:
            return answer.result(2 * timeout)
        except (concurrent.futures.TimeoutError, concurrent.futures.CancelledError):
            raise OSError("the event loop did not answer") from None

    return run


class AsyncConnection:
    """A channel to a server, opened by the first call, for one event loop at a time.

    Attributes:
        endpoint: the server and what it needs to know of its caller.
        calls: to it.
        loop: of the last call.
    """

    def __init__(self, endpoint: _channel.Endpoint) -> None:
        self.endpoint = endpoint
        self.loop: asyncio.AbstractEventLoop | None = None
        self._channel: Any = None
        self._channel_of: tuple[asyncio.AbstractEventLoop, str] | None = None
        self._closed = False
        self._transport = make_transport(endpoint.address, _running(weakref.ref(self)), self)
        self.calls = Calls(endpoint, self._transport)

    async def close(self) -> None:
        """Closes the channel."""
        if self._transport is not None:
            self._transport.close()
        self._closed = True
        channel, self._channel = self._channel, None
        if channel is not None:
            await channel.close()

    def open_channel(self) -> tuple[Any, str]:
        """Returns the channel and the address that it leads to."""
        fork_guard.check()
        if self._closed:
            raise ValueError("the client is closed")
        address = self.endpoint.address
        # Another one after the end of a local server, and in another asyncio.run().
        wanted = asyncio.get_running_loop(), address
        if self._channel is None or self._channel_of != wanted:
            self._channel = _channel.open_channel(grpc.aio, address, self.endpoint.tls)
            self._channel_of = wanted
        return self._channel, address

    async def run(self, steps: Steps[R], control: Control | None = None) -> R:
        """Performs the steps of a call and returns its result."""
        self.loop = asyncio.get_running_loop()  # which leases of memory need
        return await _Running(self, control or Control()).result(steps)


class _Running:
    """A call under way on a connection."""

    def __init__(self, connection: AsyncConnection, control: Control) -> None:
        self._connection = connection
        self._control = control
        self._call: Any = None
        self._answers: Any = None
        self._server = ""  # of the answers
        self._status: asyncio.Future[grpc.aio.AioRpcError]  # that the call ends with
        self._wake = asyncio.Event()  # the upload may continue

    async def result(self, steps: Steps[R]) -> R:
        """Performs all steps."""
        machine = Machine(steps)
        try:
            while machine.action is not None:
                try:
                    event = await self._perform(machine.action)
                except BaseException as error:
                    machine.fail(error)
                else:
                    machine.feed(event)
            return machine.result
        except BaseException:
            if self._call is not None:
                self._call.cancel()
            raise
        finally:
            self._control.arm(None)

    async def _perform(self, action: Action) -> Any:
        if action is RECEIVE:
            return await self._receive()
        if isinstance(action, Begin):
            return self._begin(action)
        if isinstance(action, Wait):
            stop = asyncio.Event()
            self._control.arm(stop.set)
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(stop.wait(), action.seconds)
        if isinstance(action, Ask):
            return await self._ask(action)
        return None

    async def _ask(self, action: Ask) -> Any:
        channel, server = self._connection.open_channel()
        try:
            return await _channel.ask(channel, action, self._connection.endpoint.metadata())
        except grpc.aio.AioRpcError as status:
            return Failed(status, server)

    def _begin(self, action: Begin) -> None:
        if self._call is not None:
            self._call.cancel()  # broken off in its midst
        channel, self._server = self._connection.open_channel()
        messages = None
        if action.upload is not None:
            messages = self._messages(action.first, action.upload)
        metadata = self._connection.endpoint.metadata()
        self._call = _channel.begin(channel, action, messages, metadata)
        self._status = asyncio.get_running_loop().create_future()
        self._call.add_done_callback(functools.partial(_note_status, self._status))
        self._answers = aiter(self._call)
        self._control.arm(self._call.cancel)

    async def _messages(self, first: bytes, upload: Upload) -> AsyncIterator[bytes]:
        """The messages of a call, which gRPC takes in a task of its own."""
        yield first
        while True:
            for chunk in upload.chunks():
                yield chunk
            if upload.complete:
                return
            await self._wake.wait()
            self._wake.clear()

    async def _receive(self) -> bytes | Failed | None:
        self._wake.set()  # the last answer may have allowed more
        try:
            answer: bytes | None = await anext(self._answers, None)
        except grpc.aio.AioRpcError as status:
            if status.details() == _UNSENT:
                status = await self._status
            return Failed(status, self._server)
        except asyncio.CancelledError:
            if self._control.cancelled:  # the call, not the task
                return None
            raise
        return answer


def _note_status(noted: asyncio.Future[grpc.aio.AioRpcError], call: Any) -> None:
    """Notes the status that a call has now, as gRPC calls this each time that it sets one."""
    code, text, metadata = map(_at_once, (call.code(), call.details(), call.trailing_metadata()))
    if text != _UNSENT and not noted.done():
        noted.set_result(grpc.aio.AioRpcError(code, grpc.aio.Metadata(), metadata, text))


def _at_once(coroutine: Coroutine[Any, Any, R]) -> R:
    """Returns the result of a coroutine that has nothing to wait for."""
    try:
        coroutine.send(None)
    except StopIteration as end:
        return end.value  # type: ignore[no-any-return]
    raise AssertionError("it waits")
