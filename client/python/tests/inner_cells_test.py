"""Cells of lower dimension inside a region stay where the boundary slides or is free."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import cube

import meshsmooth as ms
from meshsmooth._mesh import Mesh, MeshData
from meshsmooth._topology import Topology

POINTS, CELLS = cube(5)
GRID = np.stack(np.unravel_index(np.arange(125), (5, 5, 5)), -1)


def faces_in(plane: int, axis: int = 0) -> Any:
    """The triangles of the tetrahedra in a plane of nodes, each once."""
    corners = CELLS["tetra"][:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3)
    inside = (GRID[corners, axis] == plane).all(axis=1)
    return np.unique(np.sort(corners[inside], axis=1), axis=0)


def held(points: Any, cells: Any, **options: Any) -> list[int]:
    mask = Topology.of(Mesh(MeshData(points, cells)), options).mask
    return [] if mask is None else np.flatnonzero(mask).tolist()


TWO = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1.0]])
TETRA = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])


@pytest.mark.parametrize("boundary", ["slide", "free"])
def test_what_is_inside(boundary: Any) -> None:
    between = {"triangle": np.array([[3, 1, 2]]), "tetra": TETRA}
    assert held(TWO, between, boundary=boundary) == [1, 2, 3]
    outside = {"triangle": np.array([[0, 1, 2]]), "tetra": TETRA}
    assert held(TWO, outside, boundary=boundary) == []
    assert held(TWO, {"tetra": TETRA}, boundary=boundary) == []
    edges = {"line": np.array([[0, 1]]), "vertex": np.array([[4]]), "tetra": TETRA}
    assert held(TWO, edges, boundary=boundary) == []
    assert held(TWO, between) == [1, 2, 3]
    assert held(TWO, outside) == [0, 1, 2]


def test_what_is_between_regions_is_not_inside() -> None:
    cells = {"triangle": np.array([[3, 1, 2]]), "tetra": TETRA}
    assert held(TWO, cells, boundary="slide", regions=[0, 1, 2]) == []
    assert held(TWO, cells, boundary="slide", regions=[0, 1, 1]) == [1, 2, 3]


def test_lines_in_a_plane_mesh() -> None:
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0], [0.5, 0.5]])
    quad = {"triangle": np.array([[0, 1, 2], [0, 2, 3]])}
    assert held(points[:4], {"line": [[2, 0]], **quad}, boundary="free") == [0, 2]
    assert held(points[:4], {"line": [[0, 1]], **quad}, boundary="free") == []
    fan = {"triangle": np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])}
    assert held(points, {"vertex": [[4]], **fan}, boundary="free") == [4]


def test_cells_of_nodes_that_do_not_exist_are_left_to_the_server() -> None:
    cells = {"triangle": np.array([[3, 1, 9], [-1, 1, 2]]), "tetra": TETRA}
    assert held(TWO, cells, boundary="slide") == []


@pytest.mark.parametrize("boundary", ["slide", "free"])
def test_surfaces_inside_stay(client: ms.Client, boundary: Any) -> None:
    sheet, side = faces_in(2), faces_in(0, axis=1)
    mesh = (POINTS, {"triangle": np.concatenate([sheet, side]), **CELLS})
    method: Any = "optimize" if boundary == "slide" else "laplacian"
    moved = client.smooth(mesh, boundary=boundary, method=method, iterations=5, never_worse=False)[
        0
    ]
    changed = (moved != POINTS).any(axis=1)
    assert not changed[np.unique(sheet)].any()
    assert changed.sum() > 5
    if boundary == "free":
        assert changed[np.setdiff1d(side, sheet)].any()
