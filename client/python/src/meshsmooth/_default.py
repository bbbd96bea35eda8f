"""The functions without a client: they use one of the process, made at the first call."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Literal, TypeVar, overload

from numpy.typing import NDArray

from ._client import Client
from ._job_options import MOVE_OPTIONS, JobOptions, MoveOptions
from ._result import SmoothResult
from ._signature import with_options
from ._summary import QualityStats

if TYPE_CHECKING:
    from typing_extensions import Unpack

M = TypeVar("M")

_lock = threading.Lock()
_clients: dict[tuple[tuple[str, str], ...], Client] = {}


def default_client() -> Client:
    """Returns the client of `$MESHSMOOTH_SERVER`, or of a server that this process starts.

    It is made anew when the variables change.

    Raises:
        Unavailable: there is no such variable and no server to start.
    """
    prefixes = ("MESHSMOOTH_SERVER", "MESHSMOOTH_CLIENT_")
    key = tuple(sorted(item for item in os.environ.items() if item[0].startswith(prefixes)))
    with _lock:
        if key not in _clients:
            _clients.clear()
            _clients[key] = Client()
        return _clients[key]


@overload
def smooth(
    mesh: Any, *, out: NDArray[Any], full: Literal[False] = False, **options: Unpack[JobOptions]
) -> NDArray[Any]: ...
@overload
def smooth(mesh: M, *, full: Literal[False] = False, **options: Unpack[JobOptions]) -> M: ...
@overload
def smooth(
    mesh: M, *, out: NDArray[Any] | None = None, full: Literal[True], **options: Unpack[JobOptions]
) -> SmoothResult[M]: ...
@overload
def smooth(mesh: M, *, full: bool, **options: Unpack[JobOptions]) -> M | SmoothResult[M]: ...
@with_options()
def smooth(
    mesh: Any, *, out: NDArray[Any] | None = None, full: bool = False, **options: Any
) -> Any:
    """Smooths a mesh and returns one of the same kind; the argument is unchanged.

    The server is that of `$MESHSMOOTH_SERVER`, or one that this process starts.

        >>> better = ms.smooth(grid)
        >>> result = ms.smooth(grid, full=True, goal="worst", boundary="slide")
        >>> print(result.summary)

    Args:
        mesh: of PyVista, VTK, meshio, trimesh, scikit-fem, `(points, cells)`, or an `ms.MeshData`.
        out: array [nodes, 2 or 3] for the positions, which is then returned in place of a mesh.
        full: return a `SmoothResult` with `.mesh` and `.summary`. Without it there is a
            RuntimeWarning if elements of the result are inverted.

    Raises:
        Error: and its subclasses; see `Client.smooth`.
    """
    client: Any = default_client()
    return client.smooth(mesh, out=out, full=full, **options)


@overload
def move(
    mesh: Any, *, out: NDArray[Any], full: Literal[False] = False, **options: Unpack[MoveOptions]
) -> NDArray[Any]: ...
@overload
def move(mesh: M, *, full: Literal[False] = False, **options: Unpack[MoveOptions]) -> M: ...
@overload
def move(
    mesh: M, *, out: NDArray[Any] | None = None, full: Literal[True], **options: Unpack[MoveOptions]
) -> SmoothResult[M]: ...
@overload
def move(mesh: M, *, full: bool, **options: Unpack[MoveOptions]) -> M | SmoothResult[M]: ...
@with_options(MOVE_OPTIONS)
def move(mesh: Any, *, out: NDArray[Any] | None = None, full: bool = False, **options: Any) -> Any:
    """Moves nodes to given positions and lets the rest follow; returns a mesh of the same kind.

    The mesh must be valid, and the result is. The server is that of `smooth`.

        >>> moved = ms.move(grid, displacement="u", prescribed="wall")

    Args:
        mesh: as of `smooth`.
        out: as of `smooth`.
        full: return a `SmoothResult`; `summary.motion.reached` is below 1 if the motion is too
            hard. Without it there is a RuntimeWarning then.

    Raises:
        Error: and its subclasses; see `Client.move`.
    """
    client: Any = default_client()
    return client.move(mesh, out=out, full=full, **options)


@overload
def smooth_many(
    meshes: Iterable[M],
    *,
    max_in_flight: int | None = None,
    full: Literal[False] = False,
    **options: Unpack[JobOptions],
) -> Iterator[M | Exception]: ...
@overload
def smooth_many(
    meshes: Iterable[M],
    *,
    max_in_flight: int | None = None,
    full: Literal[True],
    **options: Unpack[JobOptions],
) -> Iterator[SmoothResult[M] | Exception]: ...
@with_options()
def smooth_many(
    meshes: Iterable[Any],
    *,
    max_in_flight: int | None = None,
    full: bool = False,
    **options: Any,
) -> Iterator[Any]:
    """Smooths many meshes, of which some may be bad; yields the results in their order.

    Each mesh ends by its own rule, with the bits that it has alone; where one fails, its exception
    is yielded in place of a mesh. The server is that of `smooth`.

        >>> for mesh, better in zip(meshes, ms.smooth_many(meshes), strict=True):
        ...     if isinstance(better, Exception):
        ...         print(better)

    Args:
        meshes: of any kinds that `smooth` takes; taken from the iterable as results are.
        max_in_flight: jobs at a time, 1 or more [64 of meshes below 64 KiB, 8 of others].
        full: yield a `SmoothResult` for each mesh.

    Raises:
        Error: what is wrong for all meshes; see `Client.smooth_many`.
    """
    client: Any = default_client()
    results: Iterator[Any] = client.smooth_many(
        meshes, max_in_flight=max_in_flight, full=full, **options
    )
    return results


@with_options()
def quality(mesh: Any, **options: Unpack[JobOptions]) -> QualityStats:
    """Evaluates a mesh and returns statistics and histograms of each metric; moves nothing.

        >>> print(ms.quality(grid))
        >>> ms.quality(grid).metric("mean_ratio").min

    Args:
        mesh: as of `smooth`.
    """
    return default_client().quality(mesh, **options)
