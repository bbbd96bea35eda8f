"""Pictures, by PyVista."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from ._adapters import find_adapter
from ._cell_types import ELEMENT_TO_VTK
from ._cells import Cells
from ._default import default_client
from ._job_options import Metric
from ._mesh import Mesh


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
    read = Mesh(find_adapter(mesh).read(mesh))
    evaluated = default_client().smooth(
        (read.points, _as_cells(read.cells)), full=True, iterations=0, element_quality=metric
    )
    connectivity = [
        np.insert(block.nodes, 0, block.nodes.shape[1], axis=1).reshape(-1)
        for block in read.cells.blocks
    ]
    types = [np.full(b.element_count, ELEMENT_TO_VTK[b.element_type]) for b in read.cells.blocks]
    grid = pyvista.UnstructuredGrid(
        np.concatenate(connectivity), np.concatenate(types).astype(np.uint8), read.points
    )
    values = evaluated.element_quality[metric]
    grid.cell_data[metric] = values
    plotter = pyvista.Plotter() if plotter is None else plotter
    keywords = {"scalars": metric, "cmap": "RdYlGn", "show_edges": True} | keywords
    if below is None:
        plotter.add_mesh(grid, **keywords)
    else:
        plotter.add_mesh(grid, color="lightgrey", opacity=0.15)
        worst = np.flatnonzero(values < below)
        if len(worst):
            plotter.add_mesh(grid.extract_cells(worst), **keywords)
    if show:
        plotter.show()
    return plotter


def _as_cells(cells: Cells) -> list[tuple[int, Any]]:
    return [(ELEMENT_TO_VTK[block.element_type], block.nodes) for block in cells.blocks]
