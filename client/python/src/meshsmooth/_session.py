"""Moving meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Unpack, overload

import numpy as np
from numpy.typing import NDArray

from ._job import Control
from ._mesh import Mesh
from ._options import JobOptions
from ._progress import make_display
from ._request import Topology, TopologyUse
from ._result import Finish, SmoothResult, session_request

if TYPE_CHECKING:
    from ._client import Client

Array = NDArray[Any]


class Session:
    """A mesh whose nodes move from job to job while its elements stay, as in a time-step loop.

    The same positions give the same bits, whatever the server has. Not thread-safe.
    """

    def __init__(self, client: Client, mesh: Mesh, options: JobOptions) -> None:
        self._client = client
        self._mesh = mesh
        self._options = options
        self._topology = Topology.of(mesh, options)
        self._memory: Array | None = None

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self._memory = None

    @property
    def topology_name(self) -> str:
        """The server's name of the topology, "topologies/sha256-…"."""
        return self._topology.name

    @overload
    def smooth(
        self,
        points: Array,
        *,
        out: Array | None = None,
        full: Literal[False] = False,
        **options: Unpack[JobOptions],
    ) -> Array: ...
    @overload
    def smooth(
        self,
        points: Array,
        *,
        out: Array | None = None,
        full: Literal[True],
        **options: Unpack[JobOptions],
    ) -> SmoothResult[Array]: ...
    def smooth(
        self,
        points: Array,
        *,
        out: Array | None = None,
        full: bool = False,
        **options: Unpack[JobOptions],
    ) -> Any:
        """Smooths positions of the session's mesh and returns them.

        Args:
            points: [nodes, 2 or 3], float32 or float64.
            out: array of the same shape for the result, which may be `points`.
            full: return a `SmoothResult` whose `mesh` are the positions.
            **options: as of `Client.smooth`, without those of the topology.
                `quality="brief"` saves the server most of the evaluation.
        """
        request = session_request(
            self._mesh, self._topology, self._options, options, np.asarray(points)
        )
        finish = Finish(request, out, full, lambda positions: positions, memory=self._memory)
        display = make_display(request.options.get("progress"))
        use = TopologyUse(named=True, routed=True)
        result = self._client._smooth(request, finish, Control(), display, use=use)
        self._memory = finish.own_memory
        return result
