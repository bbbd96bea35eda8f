"""`grid.meshsmooth`: what PyVista loads by its entry point `pyvista.accessors`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar, overload

import pyvista

from ._default import default_client
from ._job_options import MOVE_OPTIONS, JobOptions, MoveOptions
from ._methods import Metric
from ._result import SmoothResult
from ._session import Session
from ._signature import with_options
from ._summary import QualityStats
from ._why import Why, why

if TYPE_CHECKING:
    from typing_extensions import Unpack

M = TypeVar("M")


class MeshsmoothAccessor(Generic[M]):
    """Smooths, moves and evaluates a PyVista mesh."""

    def __init__(self, mesh: M) -> None:
        self._mesh = mesh

    @overload
    def smooth(self, *, full: Literal[False] = False, **options: Unpack[JobOptions]) -> M: ...
    @overload
    def smooth(self, *, full: Literal[True], **options: Unpack[JobOptions]) -> SmoothResult[M]: ...
    @overload
    def smooth(self, *, full: bool, **options: Unpack[JobOptions]) -> M | SmoothResult[M]: ...
    @with_options()
    def smooth(self, *, full: bool = False, **options: Unpack[JobOptions]) -> Any:
        """Returns a smoothed mesh of the same kind; with `full` a `SmoothResult`.

        >>> better = grid.meshsmooth.smooth(goal="worst")
        """
        return default_client().smooth(self._mesh, full=full, **options)

    @overload
    def move(self, *, full: Literal[False] = False, **options: Unpack[MoveOptions]) -> M: ...
    @overload
    def move(self, *, full: Literal[True], **options: Unpack[MoveOptions]) -> SmoothResult[M]: ...
    @overload
    def move(self, *, full: bool, **options: Unpack[MoveOptions]) -> M | SmoothResult[M]: ...
    @with_options(MOVE_OPTIONS)
    def move(self, *, full: bool = False, **options: Unpack[MoveOptions]) -> Any:
        """Returns a mesh of the same kind with moved nodes; with `full` a `SmoothResult`.

        >>> moved = grid.meshsmooth.move(displacement="u", prescribed="wall")
        """
        return default_client().move(self._mesh, full=full, **options)

    @with_options()
    def session(self, **options: Unpack[JobOptions]) -> Session:
        """Opens a session for many jobs on the elements of this mesh whose nodes move.

        Steps take and return positions; see `meshsmooth.Client.session`.

        >>> with grid.meshsmooth.session(boundary="slide") as session:
        ...     grid.points = session.move("wall", wall_positions)
        """
        return default_client().session(self._mesh, **options)

    @with_options()
    def quality(self, **options: Unpack[JobOptions]) -> QualityStats:
        """Returns statistics and histograms of each metric; moves nothing."""
        return default_client().quality(self._mesh, **options)

    @with_options(without=("element_quality", "iterations", "quality"))
    def why(self, cell: int, **options: Unpack[JobOptions]) -> Why:
        """Tells what keeps a cell from being better; see `meshsmooth.why`.

        >>> print(grid.meshsmooth.why(17))
        """
        return why(self._mesh, cell, **options)

    def plot_quality(
        self, metric: Metric = "mean_ratio", *, below: float | None = None, **keywords: Any
    ) -> Any:
        """Shows the mesh coloured by quality; see `meshsmooth.plot_quality`."""
        from ._plot import plot_quality

        return plot_quality(self._mesh, metric, below=below, **keywords)


for _kind in (
    pyvista.UnstructuredGrid,
    pyvista.PolyData,
    pyvista.StructuredGrid,
    pyvista.ImageData,
    pyvista.RectilinearGrid,
    pyvista.MultiBlock,
):
    pyvista.register_dataset_accessor("meshsmooth", _kind)(MeshsmoothAccessor)
