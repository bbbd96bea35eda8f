"""Jobs and sessions of the asyncio client."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Generator
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from numpy.typing import ArrayLike, NDArray

from ._errors import Cancelled, Error
from ._job_options import TOPOLOGY_OPTIONS, JobOptions
from ._progress import Progress, make_display
from ._request import Request, TopologyUse
from ._result import Finish
from ._signature import with_options
from ._steps import Steps

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._aio import AsyncClient

R = TypeVar("R")
Array = NDArray[Any]


class AsyncControl:
    """Whether the caller has cancelled a job, and the call to end then."""

    def __init__(self) -> None:
        self.cancelled = False
        self.job_name = ""
        self.call: Any = None

    def cancel(self) -> None:
        """Cancels the call under way, and those that would follow."""
        self.cancelled = True
        if self.call is not None:
            self.call.cancel()

    def check(self) -> None:
        """Raises `Cancelled` if the caller has cancelled."""
        if self.cancelled:
            raise Cancelled("cancelled", code="CANCELLED")


class AsyncJob(Generic[R]):
    """A job under way; `await job` is its result.

    Attributes:
        request_id: the UUID under which the same job can be joined.
    """

    def __init__(
        self, client: AsyncClient, request_id: str, *, kept: bool, warn: Callable[[], None]
    ) -> None:
        self.request_id = request_id
        self._client = client
        self._control = AsyncControl()
        self._kept = kept
        self._warn = warn
        self._last: Progress | None = None
        self._changed = asyncio.Event()
        self._task: asyncio.Task[R]

    def _start(self, run: Any) -> None:
        self._task = asyncio.ensure_future(run)
        self._task.add_done_callback(lambda _: self._changed.set())

    def _note(self, progress: Progress) -> None:
        self._last = progress
        self._changed.set()

    @property
    def name(self) -> str:
        """The server's name of the job, "jobs/…"; "" until it is accepted."""
        return self._control.job_name

    def __await__(self) -> Generator[Any, None, R]:
        return self.result().__await__()

    async def result(self, timeout: float | None = None) -> R:
        """Waits for the result; after `timeout` seconds raises TimeoutError, the job continues."""
        try:
            result = await asyncio.wait_for(asyncio.shield(self._task), timeout)
        except asyncio.TimeoutError as error:
            if isinstance(error, TimeoutError):
                raise
            raise TimeoutError from None  # Python 3.10 has two of them
        self._warn()
        return result

    async def progress(self) -> AsyncIterator[Progress]:
        """Yields what the server reports, the newest only, until the job has ended."""
        while not self.done():
            self._changed.clear()
            if self._last is not None:
                yield self._last
            if not self.done():
                await self._changed.wait()

    def done(self) -> bool:
        """Returns whether the job has ended, whatever its result."""
        return self._task.done()

    async def cancel(self, *, keep_result: bool = False) -> bool:
        """Cancels the job on the server; see `Job.cancel`."""
        if self.done():
            return False
        if keep_result and not self.name:
            raise Error(
                "the server has not accepted the job yet, so there is no result to keep",
                reason="JOB_NOT_FOUND",
            )
        if keep_result or (self._kept and self.name):
            await self._client.cancel(self.name, keep_result=keep_result)
        if not keep_result:
            self._control.cancel()
        return True

    def add_done_callback(self, function: Callable[[AsyncJob[R]], object]) -> None:
        """Calls `function(job)` in the event loop when the job has ended."""
        self._task.add_done_callback(lambda _: function(self))


class AsyncSession:
    """A mesh whose nodes move from job to job while its elements stay; see `Session`."""

    def __init__(self, client: AsyncClient, steps: Steps) -> None:
        self._client = client
        self._steps = steps

    async def __aenter__(self) -> AsyncSession:
        return self

    async def __aexit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the session: its memory is returned, later steps raise ValueError."""
        self._steps.close()

    @property
    def topology_name(self) -> str:
        """The server's name of the topology, "topologies/sha256-…"."""
        return self._steps.topology.name

    @property
    def positions(self) -> Array:
        """Positions of the session's own; see `Session.positions`."""
        return self._steps.positions

    @with_options(without=TOPOLOGY_OPTIONS)
    async def smooth(
        self,
        points: Array | None = None,
        *,
        out: Array | None = None,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> Any:
        """Smooths positions of the session's mesh and returns them; see `Session.smooth`."""
        return await self._run(*self._steps.smooth(points, out, full, options))

    @with_options(without=TOPOLOGY_OPTIONS)
    async def move(
        self,
        nodes: ArrayLike,
        positions: ArrayLike,
        *,
        out: Array | None = None,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> Any:
        """Moves nodes of the session's mesh and returns all positions; see `Session.move`."""
        return await self._run(*self._steps.move(nodes, positions, out, full, options))

    async def _run(self, request: Request, finish: Finish) -> Any:
        display = make_display(request.options.get("progress"))
        use = TopologyUse(named=True, routed=True)
        result = await self._client._connection.smooth(
            request, finish, AsyncControl(), display, use=use
        )
        finish.warn()
        self._steps.end(finish)
        return result
