"""The jobs of a session."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _options
from ._adapters import is_mesh, read_mesh
from ._arrays import as_coordinates
from ._checks import check_options
from ._errors import misplaced
from ._job_options import TOPOLOGY_OPTIONS, JobOptions
from ._periodic import node_pairs
from ._prescribed import Cotangents, prescribe, prescribe_tangents
from ._request import Prescribed, Request
from ._result import Finish
from ._topology import Topology
from ._transfer import Held


class Steps:
    """The jobs of a session, for the blocking and the asyncio client.

    Attributes:
        topology: of all steps that smooth.
    """

    def __init__(self, mesh: Any, options: JobOptions) -> None:
        check_options(options)
        _options.encode_options(options)  # refuses values at once, not at the first step
        read = read_mesh(mesh)
        # A copy: `move` begins at these positions, and the caller may change theirs in place.
        self._mesh = read.moved(np.array(read.data.points))
        self._options = options
        pairs = node_pairs(self._mesh, options)  # once, where the mesh is at first
        if pairs is not None:
            self._options = {**options, "periodic": pairs}
        self.topology = Topology.of(self._mesh, options)
        self._moving: Topology | None = None  # of the last step that moved
        self._memory: NDArray[Any] | None = None
        self._closed = False
        self._held = Held()
        self._positions: NDArray[Any] | None = None

    @property
    def positions(self) -> NDArray[Any]:
        """The session's own positions, which `smooth` without positions works on."""
        if self._positions is None:
            self._positions = np.array(self._mesh.data.points)
        return self._positions

    def smooth(
        self, points: NDArray[Any] | None, out: NDArray[Any] | None, full: bool, options: JobOptions
    ) -> tuple[Request, Finish]:
        """Returns the request of a step, and what makes its result."""
        joined = self._joined(options)
        if points is None:
            if out is not None:
                raise misplaced("out", "the session's own positions are smoothed in place")
            request = Request(self._mesh.moved(self.positions), joined, self.topology)
            return request, Finish(request, None, full, self._set, held=self._held)
        if not isinstance(points, np.ndarray) and is_mesh(points):
            raise TypeError("a step takes the positions of the session's mesh, as mesh.points")
        given = as_coordinates(points, "the positions")
        request = Request(self._mesh.moved(given), joined, self.topology)
        return request, self._finish(request, out, full)

    def move(
        self, nodes: Any, positions: Any, out: NDArray[Any] | None, full: bool, options: JobOptions
    ) -> tuple[Request, Finish]:
        """Returns the same of a step that moves nodes."""
        joined = _options.to_move_options(self._joined(options))
        prescribed = prescribe(self._mesh, self.topology, nodes, positions)
        request = self._moving_request(joined, prescribed)
        return request, self._finish(request, out, full)

    def jvp(self, nodes: Any, tangents: Any, options: JobOptions) -> tuple[Request, Finish]:
        """Returns the same of a derivative, forward."""
        joined = _options.to_move_options(self._joined(options))
        prescribed = prescribe_tangents(self._mesh, self.topology, nodes, tangents)
        request = self._moving_request(joined, prescribed)
        return request, Finish(request, None, False, lambda vectors: vectors)

    def vjp(self, nodes: Any, cotangents: Any, options: JobOptions) -> tuple[Request, Finish]:
        """Returns the same of a derivative, backward."""
        joined = _options.to_move_options(self._joined(options))
        given = Cotangents(self._mesh, self.topology, nodes, cotangents)
        request = self._moving_request(joined, given.prescribed)
        return request, Finish(request, None, False, given.of_prescribed)

    def _moving_request(self, options: JobOptions, prescribed: Prescribed) -> Request:
        topology = self.topology.moving(self._mesh.points, prescribed.nodes)
        if self._moving is None or not self._moving.holds_those_of(topology):
            self._moving = topology  # else its name is known
        return Request(self._mesh, options, self._moving, prescribed)

    def end(self, finish: Finish) -> None:
        """Keeps the memory of a finished step for the next one."""
        self._memory = finish.own_memory

    def close(self) -> None:
        """Keeps no memory, and refuses further steps."""
        self._closed = True
        self._memory = None
        self._held.close()

    def _set(self, positions: NDArray[Any]) -> NDArray[Any]:
        self._positions = positions
        return positions

    def _joined(self, options: JobOptions) -> JobOptions:
        if self._closed:
            raise ValueError("the session is closed")
        check_options(options)
        for name in TOPOLOGY_OPTIONS:
            if name in options:
                raise misplaced(
                    name, f"{name} holds for all steps of a session; give it to session(…)"
                )
        return {**self._options, **options}

    def _finish(self, request: Request, out: NDArray[Any] | None, full: bool) -> Finish:
        return Finish(request, out, full, lambda positions: positions, memory=self._memory)
