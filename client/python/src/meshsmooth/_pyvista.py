"""`grid.meshsmooth`: what PyVista loads by its entry point `pyvista.accessors`."""

from __future__ import annotations

from typing import Any, Unpack

import pyvista

from ._default import default_client
from ._options import JobOptions, Metric, MoveOptions
from ._summary import QualityStats


class MeshsmoothAccessor:
    """Smooths, moves and evaluates a PyVista grid or surface."""

    def __init__(self, mesh: Any) -> None:
        self._mesh = mesh

    def smooth(self, *, full: bool = False, **options: Unpack[JobOptions]) -> Any:
        """Returns a smoothed mesh of the same kind; see `meshsmooth.smooth`."""
        if full:
            return default_client().smooth(self._mesh, full=True, **options)
        return default_client().smooth(self._mesh, **options)

    def move(self, *, full: bool = False, **options: Unpack[MoveOptions]) -> Any:
        """Returns a mesh of the same kind with moved nodes; see `meshsmooth.move`."""
        if full:
            return default_client().move(self._mesh, full=True, **options)
        return default_client().move(self._mesh, **options)

    def quality(self, **options: Unpack[JobOptions]) -> QualityStats:
        """Returns statistics and histograms of each metric; see `meshsmooth.quality`."""
        return default_client().quality(self._mesh, **options)

    def plot_quality(
        self, metric: Metric = "mean_ratio", *, below: float | None = None, **keywords: Any
    ) -> Any:
        """Shows the mesh coloured by quality; see `meshsmooth.plot_quality`."""
        from ._plot import plot_quality

        return plot_quality(self._mesh, metric, below=below, **keywords)


for _kind in (pyvista.UnstructuredGrid, pyvista.PolyData):
    pyvista.register_dataset_accessor("meshsmooth", _kind)(MeshsmoothAccessor)
