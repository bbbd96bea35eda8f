"""The functions without a client: they use one of the process, made at the first call."""

from __future__ import annotations

import os
import threading
from typing import Any, Literal, TypeVar, Unpack, overload

from numpy.typing import NDArray

from ._client import Client
from ._options import JobOptions, MoveOptions
from ._result import SmoothResult
from ._summary import QualityStats

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
    mesh: Any,
    *,
    out: NDArray[Any],
    full: Literal[False] = False,
    **options: Unpack[JobOptions],
) -> NDArray[Any]: ...
@overload
def smooth(mesh: M, *, full: Literal[False] = False, **options: Unpack[JobOptions]) -> M: ...
@overload
def smooth(
    mesh: M,
    *,
    out: NDArray[Any] | None = None,
    full: Literal[True],
    **options: Unpack[JobOptions],
) -> SmoothResult[M]: ...
def smooth(mesh: Any, **keywords: Any) -> Any:
    """Smooths a mesh and returns one of the same kind; see `Client.smooth`.

    The server is that of `$MESHSMOOTH_SERVER`, or one that this process starts.
    """
    return default_client().smooth(mesh, **keywords)


@overload
def move(
    mesh: Any,
    *,
    out: NDArray[Any],
    full: Literal[False] = False,
    **options: Unpack[MoveOptions],
) -> NDArray[Any]: ...
@overload
def move(mesh: M, *, full: Literal[False] = False, **options: Unpack[MoveOptions]) -> M: ...
@overload
def move(
    mesh: M,
    *,
    out: NDArray[Any] | None = None,
    full: Literal[True],
    **options: Unpack[MoveOptions],
) -> SmoothResult[M]: ...
def move(mesh: Any, **keywords: Any) -> Any:
    """Moves nodes of a mesh to given positions; the others follow; see `Client.move`.

    The server is that of `smooth`.
    """
    return default_client().move(mesh, **keywords)


def quality(mesh: Any, **options: Unpack[JobOptions]) -> QualityStats:
    """Evaluates a mesh of any kind and returns statistics and histograms of each metric.

    Args:
        mesh: of any kind that docs/python.md lists.
        **options: `timeout`, `backend` and the like.
    """
    return default_client().quality(mesh, **options)
