"""Nodes that belong together: what is found, what travels, and that they stay matched."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import cube

import meshsmooth as ms
from meshsmooth._mesh import Mesh, MeshData
from meshsmooth._periodic import node_pairs

POINTS, CELLS = cube(5)
LEFT = np.flatnonzero(POINTS[:, 0] == 0)
RIGHT = np.flatnonzero(POINTS[:, 0] == 1)


def turned(points: Any, axis: Any, angle: float, centre: Any = (0, 0, 0)) -> Any:
    """The points turned about an axis, by Rodrigues' formula."""
    k = np.asarray(axis) / np.linalg.norm(axis)
    v = np.asarray(points) - centre
    along = (1 - np.cos(angle)) * (v @ k)[:, None] * k
    return centre + np.cos(angle) * v + np.sin(angle) * np.cross(k, v) + along


def two_sides(map_points: Any, seed: int = 3) -> tuple[Mesh, Any]:
    """A mesh with two sides, and the nodes of the second as partners of the first."""
    random = np.random.default_rng(seed)
    side = np.column_stack([2 + random.random(40), np.zeros(40), random.random(40)])
    order = random.permutation(40)
    points = np.empty((80, 3))
    points[:40] = side
    points[40 + order] = map_points(side)
    sets = {"left": np.arange(40), "right": np.arange(40, 80)}
    mesh = MeshData(points, {"triangle": np.array([[0, 1, 2]])}, node_sets=sets)
    return Mesh(mesh), 40 + order


@pytest.mark.parametrize(
    "motion",
    [
        lambda p: np.add(p, [0, 5, -1]),
        lambda p: turned(p, [0, 0, 1], 0.3),
        lambda p: turned(p, [0, 0, 1], 3.0),
        lambda p: turned(p, [1, 0.5, -2], 2.0, (1, -2, 3)),
        lambda p: turned(p, [1, 0.5, -2], np.pi, (1, -2, 3)),
    ],
)
def test_finds_translations_and_rotations(motion: Any) -> None:
    mesh, partners = two_sides(motion)
    pairs = node_pairs(mesh, {"periodic": ("left", "right")})
    assert pairs is not None
    assert pairs.tolist() == np.column_stack([np.arange(40), partners]).tolist()


def test_ways_to_say_which() -> None:
    mesh, partners = two_sides(lambda p: np.add(p, [0, 5, 0]))
    expected = np.column_stack([np.arange(40), partners])
    sides: list[Any] = [("left", "right")]
    ids: list[Any] = [(np.arange(40), np.arange(40, 80))]
    for given in (sides, ids, expected, expected.tolist()):
        assert np.array_equal(node_pairs(mesh, {"periodic": given}), expected)
    assert node_pairs(mesh, {}) is None
    assert node_pairs(mesh, {"periodic": []}) is None


def test_pairs_of_the_mesh_can_be_ignored() -> None:
    mesh, _ = two_sides(lambda p: p + [0, 5, 0])
    own = Mesh(MeshData(mesh.points, mesh.data.cells, node_pairs=np.array([[0, 40], [1, 41]])))
    given = np.array([[2, 42]])
    assert node_pairs(own, {}).tolist() == [[0, 40], [1, 41]]
    assert node_pairs(own, {"periodic": given}).tolist() == [[0, 40], [1, 41], [2, 42]]
    assert node_pairs(own, {"file_pairs": False}) is None
    assert node_pairs(own, {"file_pairs": False, "periodic": given}).tolist() == [[2, 42]]


@pytest.mark.parametrize(
    ("periodic", "reason", "text"),
    [
        (("left", "top"), "NAME_UNKNOWN", "'top'"),
        ([([0, 1], [40])], "PERIODIC_MISMATCH", "a side has 2 nodes"),
        ([[0, 80]], "OPTION_OUT_OF_RANGE", "pair 0 has node 80"),
        ([[0, 1], [-1, 2]], "OPTION_OUT_OF_RANGE", "pair 1 has node -1"),
        ("left", "OPTION_OUT_OF_RANGE", "two sides"),
        (np.zeros((2, 3), int), "OPTION_OUT_OF_RANGE", "(2, 3)"),
        (np.zeros((2, 2)), "OPTION_OUT_OF_RANGE", "integers"),
    ],
)
def test_refused_before_anything_is_sent(periodic: Any, reason: str, text: str) -> None:
    mesh, _ = two_sides(lambda p: np.add(p, [0, 5, 0]))
    with pytest.raises(ms.InvalidOption) as caught:
        node_pairs(mesh, {"periodic": periodic})
    assert caught.value.reason == reason
    assert text in str(caught.value)


def test_names_the_node_that_does_not_match() -> None:
    mesh, partners = two_sides(lambda p: np.add(p, [0, 5, 0]))
    mesh.points[partners[11], 1] += 0.25
    with pytest.raises(ms.InvalidOption) as caught:
        node_pairs(mesh, {"periodic": ("left", "right")})
    assert caught.value.reason == "PERIODIC_MISMATCH"
    assert "translated, node 11 is " in str(caught.value)


@pytest.mark.parametrize("boundary", ["fixed", "slide", "free"])
@pytest.mark.parametrize("method", ["smart-laplacian", "laplacian", "optimize", "taubin"])
def test_pairs_stay_matched(client: ms.Client, method: Any, boundary: Any) -> None:
    result = client.smooth(
        (POINTS, CELLS),
        method=method,
        boundary="slide" if (method, boundary) == ("optimize", "free") else boundary,
        iterations=3,
        never_worse=False,
        periodic=[(LEFT, RIGHT)],
        full=True,
    )
    both = np.concatenate([LEFT, RIGHT])
    assert np.array_equal(result.points[both], POINTS[both])
    assert result.summary.nodes.paired == len(both)
    assert f"{len(both)} in pairs stay" in str(result)


def test_sessions_find_pairs_once(client: ms.Client) -> None:
    with client.session((POINTS, CELLS), boundary="slide", periodic=[(LEFT, RIGHT)]) as session:
        curved = POINTS.copy()
        curved[RIGHT, 1] += 0.01 * curved[RIGHT, 2] ** 2  # no longer a translation
        result = session.smooth(curved, full=True)
    assert np.array_equal(result.points[RIGHT], curved[RIGHT])
    assert result.summary.nodes.paired == len(LEFT) + len(RIGHT)


def test_motion_takes_both_of_a_pair_or_none(client: ms.Client) -> None:
    displacement = np.zeros_like(POINTS)
    displacement[LEFT] = displacement[RIGHT] = [0, 0.01, 0]
    pairs = np.column_stack([LEFT, RIGHT])
    ends = pairs[::2].ravel()
    result = client.move(
        (POINTS, CELLS), displacement=displacement, prescribed=ends, periodic=pairs, full=True
    )
    assert np.array_equal(result.points[RIGHT][:, 1:], result.points[LEFT][:, 1:])
    assert result.summary.nodes.paired == 2 * len(pairs) - len(ends)
    with pytest.raises(ms.InvalidMesh) as caught:
        client.move((POINTS, CELLS), displacement=displacement, prescribed=LEFT, periodic=pairs)
    assert caught.value.reason == "PAIR_HALF_PRESCRIBED"


def test_servers_list_the_feature(client: ms.Client) -> None:
    assert "node_pairs" in client.info().features
