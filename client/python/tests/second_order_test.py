"""Meshes of second order: corners move as in the linear mesh, the other nodes follow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import cube
from meshes import middles_of, second_order

import meshsmooth as ms


def test_corners_move_as_in_the_linear_mesh(client: ms.Client) -> None:
    points, cells = cube()
    linear = client.smooth((points, cells))[0]
    more, finer = second_order(points, cells)

    result, _ = client.smooth((more, finer))

    assert np.array_equal(result[: len(points)], linear)
    rows = finer["tetra10"]
    for place, (a, b) in enumerate(middles_of("tetra10")):
        middle = (result[rows[:, a]] + result[rows[:, b]]) / 2
        assert np.array_equal(result[rows[:, 4 + place]], middle)


def test_move_prescribes_the_nodes_in_the_middle_of_boundary_edges(client: ms.Client) -> None:
    points, cells = second_order(*cube())
    displacement = 0.05 * np.sin(points[:, [1, 2, 0]])

    result = client.move((points, cells), displacement=displacement, full=True)

    assert result.summary.motion.reached == 1
    on_boundary = ((points == 0) | (points == points.max())).any(axis=1)
    assert np.allclose(result.mesh[0][on_boundary], (points + displacement)[on_boundary])


def test_sessions_take_them(client: ms.Client) -> None:
    points, cells = second_order(*cube())
    with client.session((points, cells)) as session:
        first = session.smooth(points)
        assert np.array_equal(first, session.smooth(points))


def test_quality_is_of_the_whole_element(client: ms.Client) -> None:
    points, cells = second_order(*cube(2))
    assert client.quality((points, cells)).inverted_element_count == 0

    points[cells["tetra10"][0, 4]] += 0.9

    assert client.quality((points, cells)).inverted_element_count > 0


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda rows: rows[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]], "MID_NODE_MISPLACED"),
        (lambda rows: rows[:, :9], "ARRAY_SIZE_MISMATCH"),
    ],
)
def test_wrong_orders(client: ms.Client, change: Any, reason: str) -> None:
    points, cells = second_order(*cube(3))
    with pytest.raises(ms.InvalidMesh) as caught:
        client.smooth((points, {"tetra10": change(cells["tetra10"])}))
    assert caught.value.reason == reason


def test_two_orders_in_one_mesh(client: ms.Client) -> None:
    points, cells = cube(3)
    more, finer = second_order(points, cells)
    with pytest.raises(ms.InvalidMesh) as caught:
        client.smooth((more, {**finer, **cells}))
    assert caught.value.reason == "MIXED_ORDERS"
