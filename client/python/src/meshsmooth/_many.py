"""Many meshes by one call: `map` and `smooth_many` of the blocking client."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Literal, TypeVar, overload

from ._checks import check_many
from ._job import Job
from ._job_options import JobOptions
from ._pipeline import Pipeline, results_in_order
from ._result import SmoothResult
from ._signature import with_options

if TYPE_CHECKING:
    from typing_extensions import Unpack

M = TypeVar("M")


class ManyMeshes:
    """The calls of a client that take many meshes."""

    def _submit(
        self, mesh: Any, pipeline: Pipeline | None, *, full: bool, options: JobOptions
    ) -> Job[Any]:
        raise NotImplementedError

    @overload
    def map(
        self,
        meshes: Iterable[M],
        *,
        max_in_flight: int | None = None,
        full: Literal[False] = False,
        **options: Unpack[JobOptions],
    ) -> Iterator[M]: ...
    @overload
    def map(
        self,
        meshes: Iterable[M],
        *,
        max_in_flight: int | None = None,
        full: Literal[True],
        **options: Unpack[JobOptions],
    ) -> Iterator[SmoothResult[M]]: ...
    @with_options()
    def map(
        self,
        meshes: Iterable[Any],
        *,
        max_in_flight: int | None = None,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> Iterator[Any]:
        """Smooths many meshes; yields the results in their order.

        No more than `max_in_flight` meshes are taken from the iterable ahead of the results. A job
        that finds the server busy is sent again when the server says. The first error is raised in
        its mesh's place, and cancels the jobs under way.

        Args:
            meshes: of any kind.
            max_in_flight: jobs at a time, 1 or more [64 of meshes below 64 KiB, 8 of others].
            full: yield a `SmoothResult` for each mesh.

        Raises:
            InvalidOption: `max_in_flight` is below 1.
        """
        check_many("map", meshes, max_in_flight, options)
        submit = functools.partial(self._submit, full=full, options=options)
        return results_in_order(meshes, max_in_flight, submit, keep_errors=False)

    @overload
    def smooth_many(
        self,
        meshes: Iterable[M],
        *,
        max_in_flight: int | None = None,
        full: Literal[False] = False,
        **options: Unpack[JobOptions],
    ) -> Iterator[M | Exception]: ...
    @overload
    def smooth_many(
        self,
        meshes: Iterable[M],
        *,
        max_in_flight: int | None = None,
        full: Literal[True],
        **options: Unpack[JobOptions],
    ) -> Iterator[SmoothResult[M] | Exception]: ...
    @with_options()
    def smooth_many(
        self,
        meshes: Iterable[Any],
        *,
        max_in_flight: int | None = None,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> Iterator[Any]:
        """Smooths many meshes, of which some may be bad; yields the results in their order.

        Each mesh ends by its own rule, with the bits that it has alone. As `map`, but a mesh that
        fails does so alone: its exception is yielded in its place.

            >>> for mesh, better in zip(meshes, ms.smooth_many(meshes), strict=True):
            ...     if isinstance(better, Exception):
            ...         print(better)

        Args:
            meshes: of any kind.
            max_in_flight: as of `map`.
            full: yield a `SmoothResult` for each mesh.

        Raises:
            InvalidOption: an option has no such value, for any mesh.
            Unavailable: what concerns all meshes, likewise AccessDenied, ends the iteration.
        """
        check_many("smooth_many", meshes, max_in_flight, options)
        submit = functools.partial(self._submit, full=full, options=options)
        return results_in_order(meshes, max_in_flight, submit, keep_errors=True)
