"""The client on asyncio: the names of the blocking one, awaited."""

from __future__ import annotations

import asyncio
import collections
import contextlib
import functools
import os
from collections.abc import AsyncIterable, AsyncIterator, Callable, Iterable
from typing import Any, Literal, TypeVar, Unpack, overload

import grpc
import grpc.aio
from numpy.typing import NDArray

from . import _call, _channel, _options, _rpc
from ._aio_job import AsyncControl, AsyncJob, AsyncSession
from ._channel import Tls, Token
from ._client import SHORT_TIMEOUT
from ._errors import Error
from ._options import JobOptions, MoveOptions
from ._progress import Display, Progress, Tee, closing, make_display
from ._request import Request, TopologyUse
from ._result import Finish, SmoothResult, Steps, prepare, prepare_move
from ._retry import Retry
from ._service_error import CallFacts, to_error
from ._summary import QualityStats
from .v1 import smoothing_pb2 as pb

M = TypeVar("M")
R = TypeVar("R")
Array = NDArray[Any]


class AsyncClient:
    """A connection to one server, or to several equal ones, for one event loop.

    Arguments and errors are those of `Client`. A mesh is read and its result made in the event
    loop; what takes long happens on the server.
    """

    def __init__(
        self,
        address: str | None = None,
        *,
        tls: Tls | bool | None = None,
        token: Token | None = None,
        token_file: str | os.PathLike[str] | None = None,
    ) -> None:
        """Does not connect yet; see `Client`."""
        self._endpoint = _channel.make_endpoint(address, tls, token, token_file)
        self._channel: Any = None
        self._last_was_accepted = False

    @property
    def address(self) -> str:
        """The address of the server."""
        return self._endpoint.address

    async def close(self) -> None:
        """Closes the connection."""
        channel, self._channel = self._channel, None
        if channel is not None:
            await channel.close()

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    @overload
    async def smooth(
        self, mesh: Any, *, out: Array, full: Literal[False] = False, **options: Unpack[JobOptions]
    ) -> Array: ...
    @overload
    async def smooth(
        self, mesh: M, *, full: Literal[False] = False, **options: Unpack[JobOptions]
    ) -> M: ...
    @overload
    async def smooth(
        self,
        mesh: M,
        *,
        out: Array | None = None,
        full: Literal[True],
        **options: Unpack[JobOptions],
    ) -> SmoothResult[M]: ...
    async def smooth(
        self,
        mesh: Any,
        *,
        out: Array | None = None,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> Any:
        """Smooths a mesh and returns one of the same kind; see `Client.smooth`.

        Cancelling the task cancels the job on the server.
        """
        request, finish = prepare(mesh, options, out, full)
        return await self._smooth(
            request, finish, AsyncControl(), make_display(options.get("progress"))
        )

    @overload
    async def move(
        self, mesh: Any, *, out: Array, full: Literal[False] = False, **options: Unpack[MoveOptions]
    ) -> Array: ...
    @overload
    async def move(
        self, mesh: M, *, full: Literal[False] = False, **options: Unpack[MoveOptions]
    ) -> M: ...
    @overload
    async def move(
        self,
        mesh: M,
        *,
        out: Array | None = None,
        full: Literal[True],
        **options: Unpack[MoveOptions],
    ) -> SmoothResult[M]: ...
    async def move(
        self,
        mesh: Any,
        *,
        out: Array | None = None,
        full: bool = False,
        **options: Unpack[MoveOptions],
    ) -> Any:
        """Moves nodes of a mesh to given positions; the others follow; see `Client.move`."""
        request, finish = prepare_move(mesh, options, out, full)
        return await self._smooth(
            request, finish, AsyncControl(), make_display(options.get("progress"))
        )

    @overload
    async def submit(
        self, mesh: M, *, full: Literal[False] = False, **options: Unpack[JobOptions]
    ) -> AsyncJob[M]: ...
    @overload
    async def submit(
        self, mesh: M, *, full: Literal[True], **options: Unpack[JobOptions]
    ) -> AsyncJob[SmoothResult[M]]: ...
    async def submit(self, mesh: Any, *, full: bool = False, **options: Unpack[JobOptions]) -> Any:
        """Starts a job and returns it at once; see `Client.submit`."""
        return self._submit(mesh, full, options)

    def _submit(
        self, mesh: Any, full: bool, options: JobOptions, *, patient: bool = False
    ) -> AsyncJob[Any]:
        request, finish = prepare(mesh, options, None, full)
        job: AsyncJob[Any] = AsyncJob(self, request.request_id, kept="result_ttl" in options)
        display = Tee(job._note, make_display(options.get("progress"), alone=False))
        job._start(self._smooth(request, finish, job._control, display, patient=patient))
        return job

    async def map(
        self,
        meshes: Iterable[Any] | AsyncIterable[Any],
        *,
        max_in_flight: int = 8,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> AsyncIterator[Any]:
        """Smooths many meshes; yields the results in their order; see `Client.map`."""
        if max_in_flight < 1:
            raise _options.out_of_range("max_in_flight", "max_in_flight must be 1 or more")
        jobs: collections.deque[AsyncJob[Any]] = collections.deque()
        try:
            async for mesh in _each(meshes):
                if len(jobs) >= max_in_flight:
                    yield await jobs.popleft()
                jobs.append(self._submit(mesh, full, options, patient=True))
            while jobs:
                yield await jobs.popleft()
        finally:
            for job in jobs:
                job._control.cancel()

    def session(self, mesh: Any, **options: Unpack[JobOptions]) -> AsyncSession:
        """Opens a session on the elements of a mesh whose nodes move; see `Client.session`."""
        return AsyncSession(self, Steps(mesh, options))

    async def attach(
        self,
        name: str,
        mesh: M,
        *,
        timeout: _options.Duration | None = None,
        progress: bool | Callable[[Progress], object] = False,
    ) -> AsyncJob[M]:
        """Returns the job that was sent with `result_ttl`; see `Client.attach`."""
        options: JobOptions = {} if timeout is None else {"timeout": timeout}
        request, finish = prepare(mesh, options, None, False)
        job: AsyncJob[M] = AsyncJob(self, "", kept=True)
        job._control.job_name = name
        display = Tee(job._note, make_display(progress))
        job._start(self._attach(name, request, finish, job._control, display))
        return job

    # --- what needs no mesh ----------------------------------------------------------------------

    async def info(self) -> _rpc.ServerInfo:
        """Describes the server."""
        return _rpc.decode_info(await self._unary(_rpc.GET_SERVER_INFO, pb.GetServerInfoRequest()))

    async def jobs(self) -> list[_rpc.JobInfo]:
        """Lists the caller's jobs, running and ended, newest first."""
        found: list[_rpc.JobInfo] = []
        request = pb.ListJobsRequest()
        while True:
            response = await self._unary(_rpc.LIST_JOBS, request)
            found += [_rpc.decode_job(job) for job in response.jobs]
            if not response.next_page_token:
                return found
            request.page_token = response.next_page_token

    async def job(self, name: str) -> _rpc.JobInfo:
        """Returns what the server knows of a job; raises NotFound."""
        return _rpc.decode_job((await self._unary(_rpc.GET_JOB, pb.GetJobRequest(name=name))).job)

    async def cancel(self, name: str, *, keep_result: bool = False) -> _rpc.JobInfo:
        """Cancels a job; see `Client.cancel`."""
        request = pb.CancelJobRequest(name=name, result_kept=keep_result)
        return _rpc.decode_job((await self._unary(_rpc.CANCEL_JOB, request)).job)

    async def delete_job(self, name: str) -> None:
        """Deletes a job that has ended, and its result."""
        await self._unary(_rpc.DELETE_JOB, pb.DeleteJobRequest(name=name))

    async def topology(self, name: str) -> _rpc.TopologyInfo:
        """Returns what the server knows of a topology that it keeps; raises NotFound."""
        answer = await self._unary(_rpc.GET_TOPOLOGY, pb.GetTopologyRequest(name=name))
        return _rpc.decode_topology(answer.topology)

    async def delete_topology(self, name: str) -> None:
        """Makes the server drop a topology; raises NotFound."""
        await self._unary(_rpc.DELETE_TOPOLOGY, pb.DeleteTopologyRequest(name=name))

    async def health(self, timeout: float = 5.0) -> bool:
        """Returns whether the server serves, as grpc.health.v1 reports."""
        return _rpc.is_serving(await self._unary(_rpc.HEALTH, _rpc.Empty(), timeout))

    async def quality(self, mesh: Any, **options: Unpack[JobOptions]) -> QualityStats:
        """Evaluates a mesh; see `meshsmooth.quality`."""
        result = await self.smooth(mesh, full=True, **_rpc.evaluate_only(options))
        return result.summary.quality_before

    # --- calls -----------------------------------------------------------------------------------

    def _own_channel(self) -> Any:
        _channel.fork_guard.check()
        if self._channel is None:
            endpoint = self._endpoint
            options = _channel.channel_options(endpoint.address, endpoint.tls)
            self._channel = (
                grpc.aio.insecure_channel(endpoint.address, options)
                if endpoint.tls is None
                else grpc.aio.secure_channel(
                    endpoint.address, _channel.channel_credentials(endpoint.tls), options
                )
            )
        return self._channel

    async def _unary(self, method: _rpc.Unary, request: Any, timeout: float = SHORT_TIMEOUT) -> Any:
        call = self._own_channel().unary_unary(
            method.path,
            request_serializer=_rpc.serialize,
            response_deserializer=method.response.FromString,
        )
        try:
            return await call(request, timeout=timeout, metadata=self._endpoint.metadata())
        except grpc.aio.AioRpcError as error:
            raise to_error(error, CallFacts(self.address, timeout)) from None

    async def _smooth(
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
        )
        with closing(display):
            while True:
                control.check()
                call = attempts.begin()
                try:
                    await self._run_smooth(call, request, control, display, attempts.retry.left())
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
            while True:
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
        facts = functools.partial(CallFacts, self.address, request.timeout)
        try:
            await self._drain(stream, receive, control, display, facts, lambda: bool(call.job_name))
        except asyncio.CancelledError:  # the task's; a job that would outlive its call ends too
            if "result_ttl" in request.options and control.job_name:
                with contextlib.suppress(Error):
                    cancel = pb.CancelJobRequest(name=control.job_name)
                    await self._unary(_rpc.CANCEL_JOB, cancel, 1.0)
            raise

    async def _attach(
        self, name: str, request: Request, finish: Finish, control: AsyncControl, display: Display
    ) -> Any:
        retry = Retry(request.timeout, request.max_attempts)
        call = _call.AttachCall(name, request, finish.memory)
        facts = functools.partial(CallFacts, self.address, request.timeout)
        with closing(display):
            while True:
                control.check()
                before = call.result.received_bytes
                try:
                    stream = self._own_channel().unary_stream(_call.ATTACH)(
                        call.first(), timeout=retry.left(), metadata=self._endpoint.metadata()
                    )
                    await self._drain(stream, call.receive, control, display, facts, lambda: True)
                    return finish(call.result, name)
                except Error as error:
                    if call.result.received_bytes > before:
                        retry.succeeded_in_part()
                    await asyncio.sleep(retry.delay_after(error))

    @staticmethod
    async def _drain(
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
        except grpc.aio.AioRpcError as error:
            raise to_error(
                error,
                facts(cancelled_by_caller=control.cancelled, answered=answered()),
            ) from None
        except asyncio.CancelledError:
            stream.cancel()
            control.check()  # the call was cancelled, not the task
            raise
        except BaseException:
            stream.cancel()
            raise
        finally:
            control.call = None


async def _each(meshes: Iterable[Any] | AsyncIterable[Any]) -> AsyncIterator[Any]:
    if isinstance(meshes, AsyncIterable):
        async for mesh in meshes:
            yield mesh
    else:
        for mesh in meshes:
            yield mesh
