"""The calls of one server on asyncio."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import functools
import weakref
from collections.abc import AsyncIterator, Callable
from typing import Any, cast

import grpc.aio

from . import _call, _channel, _rpc
from ._aio_job import AsyncControl
from ._errors import SERVER_ENDED, Error, Unavailable
from ._fork_guard import fork_guard
from ._progress import Display, Progress, closing
from ._region import Lease, RegionPool
from ._request import Request, TopologyUse
from ._result import Finish
from ._retry import Retry
from ._service_error import CallFacts, to_error
from .v1 import smoothing_pb2 as pb

_LEASE_SECONDS = 5.0


def _leasing(connection: weakref.ref[AsyncConnection]) -> Lease:
    """The call LeaseRegion from another thread, which does not keep its connection alive."""

    def lease(size: int) -> pb.LeaseRegionResponse:
        alive = connection()
        if alive is None or alive._loop is None:
            raise OSError("the connection is gone")
        call = alive.unary(
            _rpc.LEASE_REGION, pb.LeaseRegionRequest(size_bytes=size), _LEASE_SECONDS
        )
        try:
            answer = asyncio.run_coroutine_threadsafe(call, alive._loop)
        except RuntimeError:
            call.close()
            raise OSError("the event loop has ended") from None
        try:
            return cast(pb.LeaseRegionResponse, answer.result(2 * _LEASE_SECONDS))
        except (concurrent.futures.TimeoutError, concurrent.futures.CancelledError):
            raise OSError("the event loop did not answer") from None

    return lease


class AsyncConnection:
    """A channel to a server, opened by the first call, and the calls on it, for one event loop."""

    def __init__(self, endpoint: _channel.Endpoint) -> None:
        self._endpoint = endpoint
        self._channel: Any = None
        self._channel_address = ""
        self._loop: asyncio.AbstractEventLoop | None = None  # that the channel belongs to
        self._closed = False
        self._last_was_accepted = False
        self._regions: RegionPool | None = None
        if RegionPool.possible(endpoint.address):
            self._regions = RegionPool(_leasing(weakref.ref(self)))
            weakref.finalize(self, self._regions.close)

    @property
    def address(self) -> str:
        """The address of the server."""
        return self._endpoint.address

    async def close(self) -> None:
        """Closes the channel."""
        if self._regions is not None:
            self._regions.close()
        self._closed = True
        channel, self._channel = self._channel, None
        if channel is not None:
            await channel.close()

    def _own_channel(self) -> Any:
        fork_guard.check()
        if self._closed:
            raise ValueError("the client is closed")
        endpoint = self._endpoint
        address = endpoint.address
        loop = asyncio.get_running_loop()
        # Another one after the end of a local server, and in another asyncio.run().
        if self._channel is None or (self._loop, self._channel_address) != (loop, address):
            options = _channel.channel_options(address, endpoint.tls)
            self._channel = (
                grpc.aio.insecure_channel(address, options)
                if endpoint.tls is None
                else grpc.aio.secure_channel(
                    address, _channel.channel_credentials(endpoint.tls), options
                )
            )
            self._loop, self._channel_address = loop, address
        return self._channel

    def _error_of(self, failed: grpc.aio.AioRpcError, facts: CallFacts) -> Error:
        return self._endpoint.explain(to_error(failed, facts), facts)

    async def unary(
        self, method: _rpc.Unary, request: Any, timeout: float = _rpc.SHORT_TIMEOUT
    ) -> Any:
        try:
            return await self._unary(method, request, timeout)
        except Unavailable as error:
            if not _channel.may_use_next_server(error):
                raise
        return await self._unary(method, request, timeout)

    async def _unary(self, method: _rpc.Unary, request: Any, timeout: float) -> Any:
        call = self._own_channel().unary_unary(
            method.path,
            request_serializer=_rpc.serialize,
            response_deserializer=method.response.FromString,
        )
        try:
            return await call(request, timeout=timeout, metadata=self._endpoint.metadata())
        except grpc.aio.AioRpcError as failed:
            error = self._error_of(failed, CallFacts(self._channel_address, timeout))
        raise error  # here, without gRPC's as its context, which cannot be pickled

    async def smooth(
        self,
        request: Request,
        finish: Finish,
        control: AsyncControl,
        display: Display | None,
        *,
        use: TopologyUse | None = None,
        patient: bool = False,
    ) -> Any:
        attempts = _call.Attempts(
            request,
            finish.memory,
            use,
            patient=patient,
            with_progress=display is not None,
            last_was_accepted=self._last_was_accepted,
            held=finish.held,
        )
        with closing(display):
            while True:
                control.check()
                call = attempts.begin()
                self._own_channel()  # and its loop, which leases of memory need
                try:
                    with attempts.sharing(call, self._regions):
                        left = attempts.retry.left()
                        await self._run_smooth(call, request, control, display, left)
                        self._last_was_accepted = True
                        return finish(call.result, call.job_name)
                except Error as error:
                    self._last_was_accepted = False
                    await asyncio.sleep(attempts.after(error, call))

    async def _run_smooth(
        self,
        call: _call.SmoothCall,
        request: Request,
        control: AsyncControl,
        display: Display | None,
        left: float,
    ) -> None:
        upload = call.upload
        wake = asyncio.Event()

        async def messages() -> AsyncIterator[bytes]:
            yield call.first
            while call.region is None:
                for chunk in upload.chunks():
                    yield chunk
                if upload.complete:
                    return
                await wake.wait()
                wake.clear()

        def receive(message: bytes) -> Progress | None:
            progress = call.receive(message)
            control.job_name = call.job_name
            wake.set()
            return progress

        stream = self._own_channel().stream_stream(_call.SMOOTH)(
            messages(), timeout=left, metadata=self._endpoint.metadata() + call.metadata
        )
        facts = functools.partial(CallFacts, self._channel_address, request.timeout)
        try:
            await self._drain(stream, receive, control, display, facts, lambda: bool(call.job_name))
        except asyncio.CancelledError:  # the task's; a job that would outlive its call ends too
            if "result_ttl" in request.options and control.job_name:
                with contextlib.suppress(Error):
                    cancel = pb.CancelJobRequest(name=control.job_name)
                    await self.unary(_rpc.CANCEL_JOB, cancel, 1.0)
            raise

    async def attach(
        self, name: str, request: Request, finish: Finish, control: AsyncControl, display: Display
    ) -> Any:
        retry = Retry(request.timeout, request.max_attempts)
        call = _call.AttachCall(name, request, finish.memory)
        with closing(display):
            while True:
                control.check()
                before = call.result.received_bytes
                try:
                    stream = self._own_channel().unary_stream(_call.ATTACH)(
                        call.first(), timeout=retry.left(), metadata=self._endpoint.metadata()
                    )
                    facts = functools.partial(CallFacts, self._channel_address, request.timeout)
                    await self._drain(stream, call.receive, control, display, facts, lambda: True)
                    return finish(call.result, name)
                except Error as error:
                    if error.reason == SERVER_ENDED:
                        raise  # and the job with it
                    if call.result.received_bytes > before:
                        retry.succeeded_in_part()
                    await asyncio.sleep(retry.delay_after(error))

    async def _drain(
        self,
        stream: Any,
        receive: Callable[[bytes], Progress | None],
        control: AsyncControl,
        display: Display | None,
        facts: Callable[..., CallFacts],
        answered: Callable[[], bool],
    ) -> None:
        """Takes all answers of a call; raises the error that it ends with."""
        control.call = stream
        if control.cancelled:
            stream.cancel()
        try:
            async for message in stream:
                progress = receive(message)
                if progress is not None and display is not None and display(progress) is False:
                    control.cancel()
            control.check()  # cancelled, if the job has ended meanwhile too
            return
        except grpc.aio.AioRpcError as failed:
            error = self._error_of(
                failed, facts(cancelled_by_caller=control.cancelled, answered=answered())
            )
        except asyncio.CancelledError:
            stream.cancel()
            control.check()  # the call was cancelled, not the task
            raise
        except BaseException:
            stream.cancel()
            raise
        finally:
            control.call = None
        raise error  # as in `unary`
