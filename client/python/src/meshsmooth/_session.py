"""Moving meshes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, overload

from numpy.typing import ArrayLike, NDArray

from ._job_options import TOPOLOGY_OPTIONS, JobOptions
from ._request import Request
from ._result import Finish, SmoothResult
from ._signature import with_options
from ._steps import Steps

if TYPE_CHECKING:
    from typing_extensions import Unpack

Array = NDArray[Any]


class SessionBase:
    """What the sessions of both clients have in common."""

    def __init__(self, run: Callable[[Request, Finish], Any], steps: Steps) -> None:
        """Opens a session.

        Args:
            run: runs a job that names its topology.
            steps: makes the jobs.
        """
        self._run_job = run
        self._steps = steps

    def close(self) -> None:
        """Ends the session: its memory is returned, later steps raise ValueError."""
        self._steps.close()

    @property
    def topology_name(self) -> str:
        """The server's name of the topology, "topologies/sha256-…"."""
        return self._steps.topology.name

    @property
    def positions(self) -> Array:
        """Positions of the session's own, [nodes, 2 or 3], at first those of its mesh.

        `smooth()` without positions begins with them and ends in them: change them in place, and
        take the array anew after each such step. Once the memory is there that the client shares
        with a server on this host, they lie in it, and a step copies nothing.
        """
        return self._steps.positions


class Session(SessionBase):
    """A mesh whose nodes move from job to job while its elements stay, as in a time-step loop.

    The same positions give the same bits, whatever the server has. Not thread-safe.
    """

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @overload
    def smooth(
        self,
        points: Array | None = None,
        *,
        out: Array | None = None,
        full: Literal[False] = False,
        **options: Unpack[JobOptions],
    ) -> Array: ...
    @overload
    def smooth(
        self,
        points: Array | None = None,
        *,
        out: Array | None = None,
        full: Literal[True],
        **options: Unpack[JobOptions],
    ) -> SmoothResult[Array]: ...
    @with_options(without=TOPOLOGY_OPTIONS)
    def smooth(
        self,
        points: Array | None = None,
        *,
        out: Array | None = None,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> Any:
        """Smooths positions of the session's mesh and returns them.

        Args:
            points: [nodes, 2 or 3], float32 or float64; None: `positions`, in place.
            out: array of the same shape for the result, which may be `points`.
            full: return a `SmoothResult` whose `mesh` are the positions.
            **options: as of `Client.smooth`, without those of the topology.
                `quality="brief"` saves the server most of the evaluation.
        """
        return self._run(*self._steps.smooth(points, out, full, options))

    @overload
    def move(
        self,
        nodes: ArrayLike,
        positions: ArrayLike,
        *,
        out: Array | None = None,
        full: Literal[False] = False,
        **options: Unpack[JobOptions],
    ) -> Array: ...
    @overload
    def move(
        self,
        nodes: ArrayLike,
        positions: ArrayLike,
        *,
        out: Array | None = None,
        full: Literal[True],
        **options: Unpack[JobOptions],
    ) -> SmoothResult[Array]: ...
    @with_options(without=TOPOLOGY_OPTIONS)
    def move(
        self,
        nodes: ArrayLike,
        positions: ArrayLike,
        *,
        out: Array | None = None,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> Any:
        """Moves nodes of the session's mesh, lets the rest follow and returns all positions.

        Each step begins at the mesh that the session was opened with and does not depend on earlier
        steps. The server keeps that mesh, so that a step sends the prescribed nodes only.

        Args:
            nodes: prescribed nodes: indices, each once, or a boolean mask.
            positions: where they shall lie, in their order; or positions of all nodes.
            out: array of the mesh's shape for the result.
            full: return a `SmoothResult` whose `mesh` are the positions; `summary.motion` is how
                far the nodes came. Without it there is a RuntimeWarning if they did not arrive.
            **options: as of `smooth`; `method` may be an `ms.Move`.
        """
        return self._run(*self._steps.move(nodes, positions, out, full, options))

    @with_options(without=TOPOLOGY_OPTIONS)
    def jvp(self, nodes: ArrayLike, tangents: ArrayLike, **options: Unpack[JobOptions]) -> Array:
        """Returns the derivative of `move` along displacements of the prescribed nodes, forward.

        It is the product of a tangent with the Jacobian matrix of the linear prediction from which
        `move` sweeps: that of the session's mesh, whatever the motion. In float64 it is exact to a
        residual of 1e-13, so that `vjp` is its transpose.

        Args:
            nodes: prescribed nodes: indices, each once, or a boolean mask.
            tangents: their displacements in their order, [n, 2 or 3]; or those of all nodes.
            **options: as of `move`; those of sweeps do not count.

        Returns:
            The displacements of all nodes, [nodes, 2 or 3].
        """
        vectors: Array = self._run(*self._steps.jvp(nodes, tangents, options))
        return vectors

    @with_options(without=TOPOLOGY_OPTIONS)
    def vjp(self, nodes: ArrayLike, cotangents: ArrayLike, **options: Unpack[JobOptions]) -> Array:
        """Returns the derivative of a scalar by the positions of the prescribed nodes, backward.

        It is the product of a cotangent with the transpose of the matrix of `jvp`, for gradients:
        it costs one solution with the same matrix, whatever the number of prescribed nodes.

        Args:
            nodes: prescribed nodes: indices, each once, or a boolean mask.
            cotangents: the scalar's derivatives by the positions of all nodes, [nodes, 2 or 3].
            **options: as of `move`; those of sweeps do not count.

        Returns:
            Its derivatives by the positions of the prescribed nodes, in their order, [n, 2 or 3].
        """
        vectors: Array = self._run(*self._steps.vjp(nodes, cotangents, options))
        return vectors

    def _run(self, request: Request, finish: Finish) -> Any:
        result = self._run_job(request, finish)
        self._steps.end(finish)
        return result
