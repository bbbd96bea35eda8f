"""The client on asyncio: the names of the blocking one, awaited."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, TypeVar, overload

from numpy.typing import NDArray

from . import _rpc
from ._aio_connection import AsyncConnection
from ._aio_job import AsyncJob, AsyncSession
from ._aio_many import AsyncManyMeshes
from ._channel import make_endpoint
from ._control import Control
from ._credentials import Tls, Token
from ._job_options import MOVE_OPTIONS, JobOptions, MoveOptions
from ._option import Duration
from ._progress import Progress, Tee, make_display
from ._request import Request
from ._result import Finish, SmoothResult, prepare, prepare_move
from ._signature import with_options
from ._steps import Steps
from ._summary import QualityStats
from ._topology import TopologyUse

if TYPE_CHECKING:
    from typing_extensions import Unpack

M = TypeVar("M")
R = TypeVar("R")
Array = NDArray[Any]


class AsyncClient(AsyncManyMeshes):
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
        self._connection = AsyncConnection(make_endpoint(address, tls, token, token_file))

    @property
    def address(self) -> str:
        """The address of the server."""
        return self._connection.endpoint.address

    async def close(self) -> None:
        """Closes the connection."""
        await self._connection.close()

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
    @overload
    async def smooth(
        self, mesh: M, *, full: bool, **options: Unpack[JobOptions]
    ) -> M | SmoothResult[M]: ...
    @with_options()
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
        return await self._run(request, finish)

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
    @overload
    async def move(
        self, mesh: M, *, full: bool, **options: Unpack[MoveOptions]
    ) -> M | SmoothResult[M]: ...
    @with_options(MOVE_OPTIONS)
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
        return await self._run(request, finish)

    async def _run(self, request: Request, finish: Finish, use: TopologyUse | None = None) -> Any:
        control, display = Control(), make_display(request.options.get("progress"))
        steps = self._connection.calls.smooth(request, finish, control, display, use=use)
        result = await self._connection.run(steps, control)
        finish.warn()
        return result

    @overload
    async def submit(
        self, mesh: M, *, full: Literal[False] = False, **options: Unpack[JobOptions]
    ) -> AsyncJob[M]: ...
    @overload
    async def submit(
        self, mesh: M, *, full: Literal[True], **options: Unpack[JobOptions]
    ) -> AsyncJob[SmoothResult[M]]: ...
    @with_options()
    async def submit(self, mesh: Any, *, full: bool = False, **options: Unpack[JobOptions]) -> Any:
        """Starts a job and returns it at once; see `Client.submit`."""
        return self._submit(mesh, full, options)

    def _submit(
        self, mesh: Any, full: bool, options: JobOptions, *, patient: bool = False
    ) -> AsyncJob[Any]:
        request, finish = prepare(mesh, options, None, full)
        control = Control(kept="result_ttl" in options)
        job: AsyncJob[Any] = AsyncJob(request.request_id, control, self.cancel, finish.warn)
        display = Tee(job._note, make_display(options.get("progress"), alone=False))
        steps = self._connection.calls.smooth(request, finish, control, display, patient=patient)
        job._start(self._connection.run(steps, control))
        return job

    @with_options()
    def session(self, mesh: Any, **options: Unpack[JobOptions]) -> AsyncSession:
        """Opens a session on the elements of a mesh whose nodes move; see `Client.session`."""
        run = functools.partial(self._run, use=TopologyUse(named=True, routed=True))
        return AsyncSession(run, Steps(mesh, options))

    async def attach(
        self,
        name: str,
        mesh: M,
        *,
        timeout: Duration | None = None,
        progress: bool | Callable[[Progress], object] = False,
    ) -> AsyncJob[M]:
        """Returns the job that was sent with `result_ttl`; see `Client.attach`."""
        options: JobOptions = {} if timeout is None else {"timeout": timeout}
        request, finish = prepare(mesh, options, None, False)
        control = Control(name, kept=True)
        job: AsyncJob[M] = AsyncJob("", control, self.cancel, finish.warn)
        display = Tee(job._note, make_display(progress))
        job._start(
            self._connection.run(
                self._connection.calls.attach(name, request, finish, control, display), control
            )
        )
        return job

    # --- what needs no mesh ----------------------------------------------------------------------

    async def info(self) -> _rpc.ServerInfo:
        """Describes the server."""
        return await self._ask(_rpc.GET_SERVER_INFO)

    async def jobs(self) -> list[_rpc.JobInfo]:
        """Lists the caller's jobs, running and ended, newest first."""
        return await self._connection.run(self._connection.calls.jobs())

    async def job(self, name: str) -> _rpc.JobInfo:
        """Returns what the server knows of a job; raises NotFound."""
        return await self._ask(_rpc.GET_JOB, name=name)

    async def cancel(self, name: str, *, keep_result: bool = False) -> _rpc.JobInfo:
        """Cancels a job; see `Client.cancel`."""
        return await self._ask(_rpc.CANCEL_JOB, name=name, result_kept=keep_result)

    async def delete_job(self, name: str) -> None:
        """Deletes a job that has ended, and its result."""
        await self._ask(_rpc.DELETE_JOB, name=name)

    async def topology(self, name: str) -> _rpc.TopologyInfo:
        """Returns what the server knows of a topology that it keeps; raises NotFound."""
        return await self._ask(_rpc.GET_TOPOLOGY, name=name)

    async def delete_topology(self, name: str) -> None:
        """Makes the server drop a topology; raises NotFound."""
        await self._ask(_rpc.DELETE_TOPOLOGY, name=name)

    async def health(self, timeout: float = 5.0) -> bool:
        """Returns whether the server serves, as grpc.health.v1 reports."""
        return await self._ask(_rpc.HEALTH, timeout)

    async def _ask(
        self, method: _rpc.Unary[R], timeout: float = _rpc.SHORT_TIMEOUT, **fields: Any
    ) -> R:
        return await self._connection.run(self._connection.calls.ask(method, timeout, **fields))

    @with_options()
    async def quality(self, mesh: Any, **options: Unpack[JobOptions]) -> QualityStats:
        """Evaluates a mesh; see `meshsmooth.quality`."""
        evaluate = _rpc.evaluate_only(options)
        result: SmoothResult[Any] = await self.smooth(mesh, full=True, **evaluate)
        return result.summary.quality_before
