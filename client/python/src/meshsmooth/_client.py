"""The blocking client."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, TypeVar, overload

from numpy.typing import NDArray

from . import _rpc
from ._connection import Running
from ._control import Control
from ._job import Job
from ._job_options import MOVE_OPTIONS, JobOptions, MoveOptions
from ._many import ManyMeshes
from ._option import Duration
from ._pipeline import Pipeline
from ._progress import Progress, Tee, make_display
from ._request import Request
from ._result import Finish, SmoothResult, prepare, prepare_move
from ._server_client import ServerClient
from ._session import Session
from ._signature import with_options
from ._steps import Steps
from ._summary import QualityStats
from ._topology import TopologyUse

if TYPE_CHECKING:
    from typing_extensions import Unpack

M = TypeVar("M")
Array = NDArray[Any]


class Client(ServerClient, ManyMeshes):
    """A connection to one server, or to several equal ones.

    Thread-safe: calls may run concurrently. In a forked child each client connects anew, if the
    parent had not called yet; else calls raise `Error` (FORKED).
    """

    def __reduce__(self) -> tuple[Any, ...]:
        """A client of the same server, as in a graph of dask; it connects anew.

        Raises:
            TypeError: a token that is not in a file or the environment does not travel.
        """
        address, tls, token_file = self._connection.endpoint.portable()
        return functools.partial(Client, tls=tls, token_file=token_file), (address,)

    def __repr__(self) -> str:
        return f"meshsmooth.Client({self.address!r})"

    @overload
    def smooth(
        self, mesh: Any, *, out: Array, full: Literal[False] = False, **options: Unpack[JobOptions]
    ) -> Array: ...
    @overload
    def smooth(
        self, mesh: M, *, full: Literal[False] = False, **options: Unpack[JobOptions]
    ) -> M: ...
    @overload
    def smooth(
        self,
        mesh: M,
        *,
        out: Array | None = None,
        full: Literal[True],
        **options: Unpack[JobOptions],
    ) -> SmoothResult[M]: ...
    @overload
    def smooth(
        self, mesh: M, *, full: bool, **options: Unpack[JobOptions]
    ) -> M | SmoothResult[M]: ...
    @with_options()
    def smooth(
        self,
        mesh: Any,
        *,
        out: Array | None = None,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> Any:
        """Smooths a mesh and returns one of the same kind; the argument is unchanged.

        Args:
            mesh: of any kind that docs/python.md lists.
            out: array [nodes, 2 or 3] for the positions, which may be those of `mesh`; it is then
                returned in place of a mesh. After an error it is unchanged if it shares memory with
                `mesh`, else undefined.
            full: return a `SmoothResult` with `.mesh` and `.summary`.

        Raises:
            InvalidMesh: the mesh cannot be smoothed.
            InvalidOption: an option has no such value or means nothing here.
            Error: any other error of this package; see docs/python.md ("Errors").
            KeyboardInterrupt: on Ctrl-C; the job is cancelled on the server.
        """
        request, finish = prepare(mesh, options, out, full)
        return self._run(request, finish)

    @overload
    def move(
        self, mesh: Any, *, out: Array, full: Literal[False] = False, **options: Unpack[MoveOptions]
    ) -> Array: ...
    @overload
    def move(
        self, mesh: M, *, full: Literal[False] = False, **options: Unpack[MoveOptions]
    ) -> M: ...
    @overload
    def move(
        self,
        mesh: M,
        *,
        out: Array | None = None,
        full: Literal[True],
        **options: Unpack[MoveOptions],
    ) -> SmoothResult[M]: ...
    @overload
    def move(
        self, mesh: M, *, full: bool, **options: Unpack[MoveOptions]
    ) -> M | SmoothResult[M]: ...
    @with_options(MOVE_OPTIONS)
    def move(
        self,
        mesh: Any,
        *,
        out: Array | None = None,
        full: bool = False,
        **options: Unpack[MoveOptions],
    ) -> Any:
        """Moves nodes to given positions and lets the rest follow; returns a mesh of the same kind.

        The mesh must be valid, and the result is. A motion that is too hard stops on its way:
        `summary.motion.reached` is below 1, and without `full` there is a RuntimeWarning.

        Args:
            mesh: of any kind that docs/python.md lists; it is unchanged.
            out: as of `smooth`.
            full: return a `SmoothResult` with `.mesh` and `.summary`.
            **options: one of `displacement` and `to`. Only what they say of the nodes
                `prescribed` counts. The others are those of `smooth`; `method` may be an `ms.Move`.

        Raises:
            InvalidMesh: the mesh or a prescribed node is wrong.
            Error: as `smooth`.
        """
        request, finish = prepare_move(mesh, options, out, full)
        return self._run(request, finish)

    def _run(self, request: Request, finish: Finish, use: TopologyUse | None = None) -> Any:
        control, display = Control(), make_display(request.options.get("progress"))
        steps = self._connection.calls.smooth(request, finish, control, display, use=use)
        result = self._connection.run(steps, control)
        finish.warn()
        return result

    @overload
    def submit(
        self, mesh: M, *, full: Literal[False] = False, **options: Unpack[JobOptions]
    ) -> Job[M]: ...
    @overload
    def submit(
        self, mesh: M, *, full: Literal[True], **options: Unpack[JobOptions]
    ) -> Job[SmoothResult[M]]: ...
    @with_options()
    def submit(self, mesh: Any, *, full: bool = False, **options: Unpack[JobOptions]) -> Any:
        """Starts a job and returns its future at once; arguments as of `smooth`.

        With `result_ttl` the job outlives this process, and `attach` takes its result later.

        Raises:
            InvalidMesh: the mesh cannot be encoded. What the server refuses, `Job.result` raises.
            InvalidOption: likewise.
        """
        return self._submit(mesh, None, full=full, options=options)

    def _submit(
        self, mesh: Any, pipeline: Pipeline | None, *, full: bool, options: JobOptions
    ) -> Job[Any]:
        request, finish = prepare(mesh, options, None, full)
        control = Control(kept="result_ttl" in options)
        job: Job[Any] = Job(request.request_id, control, self.cancel, finish.warn)
        display = make_display(options.get("progress"), alone=False)
        if pipeline is None:
            display = Tee(job._note, display)
        steps = self._connection.calls.smooth(
            request, finish, control, display, patient=pipeline is not None
        )
        if pipeline is not None and display is None and request.is_small:
            pipeline.add(job, functools.partial(Running, self._connection, steps, control))
        else:
            job._start(functools.partial(self._connection.run, steps, control))
        return job

    @with_options()
    def session(self, mesh: Any, **options: Unpack[JobOptions]) -> Session:
        """Opens a session for many jobs on the elements of a mesh whose nodes move.

        The server keeps the elements, so that a step sends positions only, 12 or 24 bytes a node.

        Args:
            mesh: of any kind; its positions are sent only if steps `move` its nodes.
            **options: `fixed`, `fixed_types`, `regions` and `boundary` hold for all steps; the
                others are defaults of the steps.
        """
        run = functools.partial(self._run, use=TopologyUse(named=True, routed=True))
        return Session(run, Steps(mesh, options))

    def attach(
        self,
        name: str,
        mesh: M,
        *,
        timeout: Duration | None = None,
        progress: bool | Callable[[Progress], object] = False,
    ) -> Job[M]:
        """Returns the future of a job that was sent with `result_ttl`.

        Args:
            name: "jobs/…", as `Job.name` and `jobs` have it.
            mesh: the mesh that was sent.
            timeout: of waiting and receiving [by the size of the mesh].
            progress: as of `smooth`.
        """
        options: JobOptions = {} if timeout is None else {"timeout": timeout}
        request, finish = prepare(mesh, options, None, False)
        control = Control(name, kept=True)
        job: Job[M] = Job("", control, self.cancel, finish.warn)
        display = Tee(job._note, make_display(progress))
        steps = self._connection.calls.attach(name, request, finish, control, display)
        job._start(functools.partial(self._connection.run, steps, control))
        return job

    @with_options()
    def quality(self, mesh: Any, **options: Unpack[JobOptions]) -> QualityStats:
        """Evaluates a mesh; see `meshsmooth.quality`."""
        evaluate = _rpc.evaluate_only(options)
        result: SmoothResult[Any] = self.smooth(mesh, full=True, **evaluate)
        return result.summary.quality_before
