"""Jobs and sessions of the asyncio client."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Generator
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from numpy.typing import ArrayLike, NDArray

from ._control import Control
from ._job_options import TOPOLOGY_OPTIONS, JobOptions
from ._progress import Progress
from ._request import Request
from ._result import Finish
from ._session import SessionBase
from ._signature import with_options

if TYPE_CHECKING:
    from typing_extensions import Unpack

R = TypeVar("R")
Array = NDArray[Any]


class AsyncJob(Generic[R]):
    """A job under way; `await job` is its result.

    Attributes:
        request_id: the UUID under which the same job can be joined.
    """

    def __init__(
        self,
        request_id: str,
        control: Control,
        cancel: Callable[..., Awaitable[object]],
        warn: Callable[[], None],
    ) -> None:
        self.request_id = request_id
        self._control = control
        self._cancel = cancel  # on the server, by name
        self._warn = warn
        self._last: Progress | None = None
        self._changed = asyncio.Event()
        self._task: asyncio.Task[R]

    def _start(self, run: Coroutine[Any, Any, R]) -> None:
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
        if self._control.concerns_server(keep_result=keep_result):
            await self._cancel(self.name, keep_result=keep_result)
        if not keep_result:
            self._control.cancel()
        return True

    def add_done_callback(self, function: Callable[[AsyncJob[R]], object]) -> None:
        """Calls `function(job)` in the event loop when the job has ended."""
        self._task.add_done_callback(lambda _: function(self))


class AsyncSession(SessionBase):
    """A mesh whose nodes move from job to job while its elements stay; see `Session`."""

    async def __aenter__(self) -> AsyncSession:
        return self

    async def __aexit__(self, *_: object) -> None:
        self.close()

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

    @with_options(without=TOPOLOGY_OPTIONS)
    async def jvp(
        self, nodes: ArrayLike, tangents: ArrayLike, **options: Unpack[JobOptions]
    ) -> Array:
        """Returns the derivative of `move` along a displacement; see `Session.jvp`."""
        vectors: Array = await self._run(*self._steps.jvp(nodes, tangents, options))
        return vectors

    @with_options(without=TOPOLOGY_OPTIONS)
    async def vjp(
        self, nodes: ArrayLike, cotangents: ArrayLike, **options: Unpack[JobOptions]
    ) -> Array:
        """Returns the derivative of a scalar by the prescribed positions; see `Session.vjp`."""
        vectors: Array = await self._run(*self._steps.vjp(nodes, cotangents, options))
        return vectors

    async def _run(self, request: Request, finish: Finish) -> Any:
        result = await self._run_job(request, finish)
        self._steps.end(finish)
        return result
