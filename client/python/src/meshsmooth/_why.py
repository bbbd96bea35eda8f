"""What keeps one element from being better."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from numbers import Integral
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ._adapters import find_adapter
from ._default import default_client
from ._errors import misplaced, out_of_range
from ._job_options import JobOptions
from ._mesh import Mesh, chosen_nodes
from ._signature import with_options

if TYPE_CHECKING:
    from typing_extensions import Unpack

_LEAST_GAIN = 1e-3


@dataclass(frozen=True)
class Why:
    """Why an element is as it is.

    Attributes:
        cell: the cell, as the caller counts.
        reason: "locked": all its nodes are fixed; "limited": no allowed move of its nodes makes its
            ball better; "improvable": moving its nodes does, so a job that had it in sight was kept
            from it by its end rule or by elements around.
        mean_ratio: its quality.
        best_mean_ratio: the one that moving its nodes alone gave it.
        nodes: its nodes.
        free_node_count: how many of them may move.
    """

    cell: int
    reason: Literal["locked", "limited", "improvable"]
    mean_ratio: float
    best_mean_ratio: float
    nodes: tuple[int, ...]
    free_node_count: int

    def __str__(self) -> str:
        what = {
            "locked": "locked: all its nodes are fixed, smoothing cannot improve it",
            "limited": "limited by connectivity: no allowed move of its nodes helps its ball",
            "improvable": f"improvable: moving its nodes alone gives {self.best_mean_ratio:.4g}",
        }[self.reason]
        return (
            f"cell {self.cell}, mean ratio {self.mean_ratio:.4g}, "
            f"{self.free_node_count} of {len(self.nodes)} nodes free: {what}"
        )


@with_options(without=("element_quality", "iterations", "quality"))
def why(mesh: Any, cell: int, **options: Unpack[JobOptions]) -> Why:
    """Tells what keeps an element from being better, by moving its nodes alone.

        >>> print(ms.why(grid, 17, boundary="slide"))

    Args:
        mesh: of any kind.
        cell: index of the cell, through all blocks.

    Raises:
        InvalidOption: the mesh has no such cell, or it is not an element.
    """
    for name in ("element_quality", "iterations", "quality"):
        if name in options:
            raise misplaced(name, f"{name} means nothing to why(…)")
    read = Mesh(find_adapter(mesh).read(mesh))
    nodes = _nodes_of(read, cell)
    held = np.ones(read.node_count, bool)
    held[nodes] = False
    fixed = options.get("fixed")
    if fixed is not None:
        held[chosen_nodes(read, fixed, "fixed")] = True
    data = dataclasses.replace(read.data, cell_ids=None, node_ids=None)
    alone: JobOptions = {**options, "fixed": held, "element_quality": "mean_ratio"}
    client: Any = default_client()
    before = client.smooth(data, full=True, **{**alone, "iterations": 0})
    after = client.smooth(data, full=True, **alone)
    counts = after.summary.nodes
    free = counts.total - counts.fixed - counts.isolated
    value, best = (float(r.element_quality["mean_ratio"][cell]) for r in (before, after))
    reason: Literal["locked", "limited", "improvable"] = "limited"
    if free == 0:
        reason = "locked"
    elif best > value + _LEAST_GAIN:
        reason = "improvable"
    return Why(int(cell), reason, value, best, tuple(map(int, nodes)), free)


def _nodes_of(mesh: Mesh, cell: int) -> Any:
    cells = mesh.cells
    if not isinstance(cell, Integral):
        raise out_of_range("cell", f"cell is {cell!r}, it must be a whole number")
    if not 0 <= cell < cells.cell_count:
        raise out_of_range("cell", f"cell {cell} is not in the mesh of {cells.cell_count} cells")
    element = cell
    if cells.element_cells is not None:
        found = np.flatnonzero(cells.element_cells == cell)
        element = int(found[0]) if len(found) else cells.element_count
    for block in cells.blocks:
        if element < block.element_count:
            return block.nodes[element]
        element -= block.element_count
    raise out_of_range("cell", f"cell {cell} is not an element: its dimension is lower")
