"""Many meshes by one call: `map` and `smooth_many` of the client on asyncio."""

from __future__ import annotations

import collections
from collections.abc import AsyncIterable, AsyncIterator, Iterable
from typing import TYPE_CHECKING, Any

from ._aio_job import AsyncJob
from ._checks import check_many
from ._errors import is_of_one_mesh
from ._job_options import JobOptions
from ._signature import with_options

if TYPE_CHECKING:
    from typing_extensions import Unpack

_SOME = 8  # jobs at a time


class AsyncManyMeshes:
    """The calls of a client that take many meshes."""

    def _submit(
        self, mesh: Any, full: bool, options: JobOptions, *, patient: bool = False
    ) -> AsyncJob[Any]:
        raise NotImplementedError

    @with_options()
    async def map(
        self,
        meshes: Iterable[Any] | AsyncIterable[Any],
        *,
        max_in_flight: int | None = None,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> AsyncIterator[Any]:
        """Smooths many meshes; yields the results in their order; see `Client.map`."""
        check_many("map", meshes, max_in_flight, options)
        async for result in self._results(meshes, max_in_flight, full, options):
            if isinstance(result, Exception):
                raise result
            yield result

    @with_options()
    async def smooth_many(
        self,
        meshes: Iterable[Any] | AsyncIterable[Any],
        *,
        max_in_flight: int | None = None,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> AsyncIterator[Any]:
        """Smooths many meshes, each with its own end and errors; see `Client.smooth_many`."""
        check_many("smooth_many", meshes, max_in_flight, options)
        async for result in self._results(meshes, max_in_flight, full, options):
            yield result

    async def _results(
        self,
        meshes: Iterable[Any] | AsyncIterable[Any],
        max_in_flight: int | None,
        full: bool,
        options: JobOptions,
    ) -> AsyncIterator[Any]:
        """Results, and the errors of single meshes, in the order of the meshes."""
        jobs: collections.deque[AsyncJob[Any] | Exception] = collections.deque()
        try:
            async for mesh in _each(meshes):
                if len(jobs) >= (max_in_flight or _SOME):
                    yield await _first_result(jobs)
                try:
                    jobs.append(self._submit(mesh, full, options, patient=True))
                except Exception as error:
                    jobs.append(error)
            while jobs:
                yield await _first_result(jobs)
        finally:
            for job in jobs:
                if not isinstance(job, Exception):
                    job._control.cancel()


async def _first_result(jobs: collections.deque[AsyncJob[Any] | Exception]) -> Any:
    """Waits for the first job, which stays in the queue until then, to be cancelled."""
    job = jobs[0]
    try:
        result = job if isinstance(job, Exception) else await job
    except Exception as error:
        if not is_of_one_mesh(error):
            raise
        result = error
    jobs.popleft()
    return result


async def _each(meshes: Iterable[Any] | AsyncIterable[Any]) -> AsyncIterator[Any]:
    if isinstance(meshes, AsyncIterable):
        async for mesh in meshes:
            yield mesh
    else:
        for mesh in meshes:
            yield mesh
