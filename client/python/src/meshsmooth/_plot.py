"""Pictures, by PyVista."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from ._adapters import find_adapter
from ._cell_types import ELEMENT_TO_VTK
from ._cells import Cells
from ._default import default_client
from ._mesh import Mesh
from ._methods import Metric
from ._result import SmoothResult


def plot_quality(
    mesh: Any,
    metric: Metric = "mean_ratio",
    *,
    below: float | None = None,
    plotter: Any = None,
    show: bool = True,
    **keywords: Any,
) -> Any:
    """Shows a mesh coloured by the quality of its elements; needs PyVista.

    Args:
        mesh: of any kind.
        metric: by which elements are coloured.
        below: only elements with a lower value are shown as solids, the boundary translucent.
        plotter: a `pyvista.Plotter` to draw into; None: a new one.
        show: open the window or the notebook's view.
        **keywords: for `Plotter.add_mesh`.

    Returns:
        The plotter.

    Raises:
        ModuleNotFoundError: PyVista is not installed.
    """
    pyvista: Any = importlib.import_module("pyvista")
    grid = _evaluated(Mesh(find_adapter(mesh).read(mesh)), metric)
    plotter = pyvista.Plotter() if plotter is None else plotter
    _draw(plotter, grid, metric, below, keywords)
    if show:
        plotter.show()
    return plotter


def plot_change(
    before: Mesh, after: Mesh, metric: Metric, below: float | None, show: bool, keywords: Any
) -> Any:
    """Shows a mesh before and after, side by side, with one camera; see `SmoothResult.plot`."""
    pyvista: Any = importlib.import_module("pyvista")
    grids = [_evaluated(mesh, metric) for mesh in (before, after)]
    values = np.concatenate([grid.cell_data[metric] for grid in grids])
    if below is None and not metric.endswith("angle"):
        below = float(np.nanpercentile(values, 5))  # the worst are what is to be seen
    plotter = pyvista.Plotter(shape=(1, 2))
    keywords = {"clim": (float(np.nanmin(values)), float(np.nanmax(values)))} | keywords
    for column, (grid, title) in enumerate(zip(grids, ("before", "after"), strict=True)):
        plotter.subplot(0, column)
        _draw(plotter, grid, metric, below, keywords)
        least = float(np.nanmin(grid.cell_data[metric]))
        plotter.add_text(f"{title}: least {metric.replace('_', ' ')} {least:.4g}", font_size=10)
    plotter.link_views()
    if show:
        plotter.show()
    return plotter


SmoothResult._plot_change = staticmethod(plot_change)


def _evaluated(mesh: Mesh, metric: Metric) -> Any:
    """The elements as PyVista's grid, with the metric as a cell array."""
    pyvista: Any = importlib.import_module("pyvista")
    evaluated: Any = default_client().smooth(
        (mesh.points, _as_cells(mesh.cells)), full=True, iterations=0, element_quality=metric
    )
    blocks = mesh.cells.blocks
    connectivity = [
        np.insert(block.nodes, 0, block.nodes.shape[1], axis=1).reshape(-1) for block in blocks
    ]
    types = [np.full(b.element_count, ELEMENT_TO_VTK[b.element_type]) for b in blocks]
    grid = pyvista.UnstructuredGrid(
        np.concatenate(connectivity), np.concatenate(types).astype(np.uint8), mesh.points
    )
    grid.cell_data[metric] = evaluated.element_quality[metric]
    return grid


def _draw(plotter: Any, grid: Any, metric: str, below: float | None, keywords: Any) -> None:
    keywords = {"scalars": metric, "cmap": "RdYlGn", "show_edges": True} | keywords
    if below is None:
        plotter.add_mesh(grid, **keywords)
        return
    plotter.add_mesh(grid, color="lightgrey", opacity=0.15)
    worst = np.flatnonzero(grid.cell_data[metric] < below)
    if len(worst):
        plotter.add_mesh(grid.extract_cells(worst), **keywords)


def _as_cells(cells: Cells) -> list[tuple[int, Any]]:
    return [(ELEMENT_TO_VTK[block.element_type], block.nodes) for block in cells.blocks]
