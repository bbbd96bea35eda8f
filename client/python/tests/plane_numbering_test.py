"""Plane meshes whose elements are numbered in both directions, as solvers write them.

They come back with their area, which VTK finds when the elements have been turned to one side, and
with the bits of the mesh that is numbered in one direction.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meshsmooth as ms

Points = NDArray[np.float64]
Turned = NDArray[np.bool_]
WAYS: list[ms.JobOptions] = [
    {},
    {"method": ms.Optimize(goal="worst")},
    {"method": "smart-laplacian"},
    {"boundary": "slide"},
]


def lattice(
    n: int, quads: bool, place: Callable[..., Any] = lambda x, y: (x, y)
) -> tuple[Points, dict[str, Any]]:
    """A square of n cells a side, shaken inside, counter-clockwise, then mapped."""
    random = np.random.default_rng(4)
    u = np.stack(np.unravel_index(np.arange((n + 1) ** 2), (n + 1, n + 1)), -1).astype(float)
    inside = ((u > 0) & (u < n)).all(axis=1)
    u[inside] += random.uniform(-0.3, 0.3, (int(inside.sum()), 2))
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    boxes = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], -1).reshape(-1, 4)
    halves = np.concatenate([boxes[:, [0, 1, 2]], boxes[:, [0, 2, 3]]])
    x, y = place(*(u.T / n))
    return np.stack([x, y, 0 * x], -1), {"quad": boxes} if quads else {"triangle": halves}


def annulus(u: Any, v: Any) -> Any:
    """Three quarters of it, as around a cylinder."""
    return (1 + 4 * u**2) * np.cos(4.7 * v), (1 + 4 * u**2) * np.sin(4.7 * v)


def small(u: Any, v: Any) -> Any:
    return 2e-3 * u, 1e-3 * v + 1e-4 * np.sin(6 * u)


def joined(*parts: tuple[Points, dict[str, Any]]) -> tuple[Points, dict[str, Any]]:
    """Meshes side by side that share no node: the other side is a component of its own."""
    points, cells = [], {}
    first = 0
    for at, own in parts:
        points.append(at)
        for kind, nodes in own.items():
            cells[kind] = [*cells.get(kind, []), *(nodes + first).tolist()]
        first += len(at)
    return np.concatenate(points), {kind: np.array(nodes) for kind, nodes in cells.items()}


def shifted(mesh: tuple[Points, dict[str, Any]], x: float) -> tuple[Points, dict[str, Any]]:
    return mesh[0] + [x, 0, 0], mesh[1]


def mixed(n: int) -> tuple[Points, dict[str, Any]]:
    """Quads on the left, triangles on the right."""
    points, cells = lattice(n, quads=True)
    left = np.arange(len(cells["quad"])) < len(cells["quad"]) // 2
    rest = cells["quad"][~left]
    triangles = np.concatenate([rest[:, [0, 1, 2]], rest[:, [0, 2, 3]]])
    return points, {"quad": cells["quad"][left], "triangle": triangles}


def centres(points: Points, nodes: Any) -> Points:
    found: Points = points[nodes].mean(axis=1)
    return found


# As those of SU2, scikit-fem, getfem, sfepy and deal.II: by patch, by half, at random, by part.
MESHES: dict[str, tuple[tuple[Points, dict[str, Any]], Callable[[Points, Any], Turned]]] = {
    "triangles, a patch": (lattice(9, False), lambda c, _: np.hypot(*(c - 0.4)[:, :2].T) < 0.3),
    "quads, a patch": (lattice(9, True), lambda c, _: np.hypot(*(c - 0.4)[:, :2].T) < 0.3),
    "triangles, half": (lattice(8, False), lambda c, _: c[:, 0] < 0.5),
    "quads, more than half": (lattice(8, True), lambda c, _: c[:, 0] < 0.7),
    "triangles at random": (lattice(9, False), lambda c, random: random.random(len(c)) < 0.5),
    "quads and triangles at random": (mixed(8), lambda c, random: random.random(len(c)) < 0.4),
    "a cylinder's surroundings": (lattice(10, False, annulus), lambda c, _: c[:, 0] > 0),
    "a cylinder's, of quads": (lattice(10, True, annulus), lambda c, _: c[:, 1] > 0),
    "millimetres": (lattice(9, False, small), lambda c, _: c[:, 0] < 7e-4),
    "two parts": (
        joined(lattice(6, False), shifted(lattice(6, False), 3)),
        lambda c, _: c[:, 0] > 2,
    ),
}


def vtk_area(points: Points, cells: dict[str, Any]) -> float:
    """The sum of the elements' areas, each by VTK with the sign of its side."""
    pyvista = pytest.importorskip("pyvista", reason="missing package: pyvista")
    kinds = {"triangle": pyvista.CellType.TRIANGLE, "quad": pyvista.CellType.QUAD}
    grid = pyvista.UnstructuredGrid({kinds[kind]: nodes for kind, nodes in cells.items()}, points)
    return float(grid.compute_cell_sizes(length=False, volume=False)["Area"].sum())


def is_clockwise(points: Points, nodes: Any) -> Turned:
    x, y = points[nodes][..., 0], points[nodes][..., 1]
    doubled = x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)
    found: Turned = doubled.sum(axis=1) < 0
    return found


@pytest.mark.parametrize("name", MESHES)
def test_they_come_back_with_their_area(client: ms.Client, name: str) -> None:
    (points, cells), chosen = MESHES[name]
    area = vtk_area(points, cells)
    random = np.random.default_rng(5)
    written, turned = {}, {}
    for kind, nodes in cells.items():
        turned[kind] = chosen(centres(points, nodes), random)
        other_way = np.concatenate([nodes[:, :1], nodes[:, :0:-1]], axis=1)
        written[kind] = np.where(turned[kind][:, None], other_way, nodes)
    for way in WAYS:
        result = client.smooth((points, written), full=True, **way)
        after = result.points
        assert (after != points).any(), way
        assert result.summary.quality_after.inverted_element_count == 0
        for kind in cells:
            sides = is_clockwise(after, written[kind]) == turned[kind]
            assert sides.all(), (way, "an element has another side than in the input")
        assert np.array_equal(after, client.smooth((points, cells), **way)[0]), way
        if "boundary" not in way:  # nodes that slide on a curve change what it encloses
            assert vtk_area(after, cells) == pytest.approx(area, rel=1e-12, abs=0), way
