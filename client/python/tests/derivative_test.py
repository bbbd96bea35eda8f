"""`Session.jvp` and `Session.vjp`: transposes of each other, and what is refused."""

from __future__ import annotations

import asyncio
from typing import Any

import numpy as np
import pytest
from conftest import cube

import meshsmooth as ms

MESH = cube(5)
POINTS = MESH[0]
BELOW = (POINTS[:, 2] == 0).nonzero()[0]
RANDOM = np.random.default_rng(3)
TANGENTS = RANDOM.standard_normal((len(BELOW), 3))
COTANGENTS = RANDOM.standard_normal(POINTS.shape)


@pytest.mark.parametrize("boundary", ["fixed", "slide", "free"])
def test_they_are_transposes(client: ms.Client, boundary: Any) -> None:
    with client.session(MESH, boundary=boundary) as session:
        forward = session.jvp(BELOW, TANGENTS)
        reverse = session.vjp(BELOW, COTANGENTS)
    assert forward.shape == POINTS.shape
    assert reverse.shape == TANGENTS.shape
    assert (forward[BELOW] == TANGENTS).all()
    expected = np.vdot(forward, COTANGENTS)
    assert np.vdot(TANGENTS, reverse) == pytest.approx(expected, rel=1e-12)


def test_they_are_the_motion_without_sweeps(client: ms.Client) -> None:
    step = 1e-3
    with client.session(MESH, boundary="slide") as session:
        moved = session.move(BELOW, POINTS[BELOW] + step * TANGENTS, iterations=0)
        forward = session.jvp(BELOW, TANGENTS)
        assert np.abs((moved - POINTS) / step - forward).max() < 2e-3
        # Linear: differences of any length are exact.
        twice = session.jvp(BELOW, 2 * TANGENTS)
        assert np.abs(twice - 2 * forward).max() < 1e-12


def test_nodes_and_tangents_as_of_move(client: ms.Client) -> None:
    with client.session(MESH, boundary="slide") as session:
        expected = session.jvp(BELOW, TANGENTS)
        of_all = np.zeros_like(POINTS)
        of_all[BELOW] = TANGENTS
        assert (session.jvp(POINTS[:, 2] == 0, of_all) == expected).all()
        reverse = session.vjp(BELOW, COTANGENTS)
        back = session.vjp(BELOW[::-1], COTANGENTS)
        assert (back[::-1] == reverse).all()


def test_asyncio_gives_the_same_bits(client: ms.Client, server: str) -> None:
    async def run() -> list[Any]:
        async with ms.AsyncClient(server) as other, other.session(MESH) as session:
            return [await session.jvp(BELOW, TANGENTS), await session.vjp(BELOW, COTANGENTS)]

    with client.session(MESH) as session:
        expected = [session.jvp(BELOW, TANGENTS), session.vjp(BELOW, COTANGENTS)]
    for own, of_asyncio in zip(expected, asyncio.run(run()), strict=True):
        assert (own == of_asyncio).all()


def test_plane_meshes(client: ms.Client) -> None:
    x, y = np.meshgrid(np.linspace(0, 1, 6), np.linspace(0, 1, 6))
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    first = (np.arange(30).reshape(5, 6)[:, :5]).ravel()
    cells = {"quad": np.stack([first, first + 1, first + 7, first + 6], axis=1)}
    side = (points[:, 0] == 0).nonzero()[0]
    u, w = RANDOM.standard_normal((6, 2)), RANDOM.standard_normal((36, 2))
    with client.session((points, cells)) as session:
        forward, reverse = session.jvp(side, u), session.vjp(side, w)
    assert forward.shape == points.shape
    assert reverse.shape == u.shape
    assert np.vdot(forward, w) == pytest.approx(np.vdot(u, reverse), rel=1e-12)


def test_nodes_at_one_position_move_together(client: ms.Client) -> None:
    """Two blocks side by side, whose common nodes are there twice."""
    points, cells = MESH
    both = np.concatenate([points, points + [1, 0, 0]])
    tetrahedra = np.concatenate([cells["tetra"], cells["tetra"] + len(points)])
    below = (both[:, 2] == 0).nonzero()[0]
    w = RANDOM.standard_normal(both.shape)
    u = RANDOM.standard_normal((len(below), 3))
    with client.session((both, {"tetra": tetrahedra}), merge_coincident=True) as session:
        forward, reverse = session.jvp(below, u), session.vjp(below, w)
    assert np.vdot(forward, w) == pytest.approx(np.vdot(u, reverse), rel=1e-12)


def test_single_precision(client: ms.Client) -> None:
    mesh = (POINTS.astype("f4"), MESH[1])
    with client.session(mesh) as session, client.session(MESH) as double:
        reverse = session.vjp(BELOW, COTANGENTS)
        assert reverse.dtype == np.float32
        assert np.abs(reverse - double.vjp(BELOW, COTANGENTS)).max() < 1e-4


@pytest.mark.parametrize(
    ("cotangents", "reason"),
    [
        (COTANGENTS[:-1], "ARRAY_SIZE_MISMATCH"),
        (COTANGENTS[:, :2], "ARRAY_SIZE_MISMATCH"),
        (COTANGENTS * np.nan, "NON_FINITE_COORDINATE"),
    ],
)
def test_cotangents_that_are_refused(cotangents: Any, reason: str) -> None:
    session = ms.Client("unix:/nowhere").session(MESH)
    with pytest.raises(ms.InvalidMesh) as caught:
        session.vjp(BELOW, cotangents)
    assert caught.value.reason == reason


def test_nodes_that_are_refused() -> None:
    session = ms.Client("unix:/nowhere").session(MESH, fixed=[3])
    for call in (lambda n: session.jvp(n, TANGENTS[:2]), lambda n: session.vjp(n, COTANGENTS)):
        for nodes, reason in (
            ([4, 4], "PRESCRIBED_TWICE"),
            ([4, 3], "PRESCRIBED_AND_FIXED"),
            ([4, 999], "INDEX_OUT_OF_RANGE"),
            ([], "OPTION_OUT_OF_RANGE"),
        ):
            with pytest.raises((ms.InvalidMesh, ms.InvalidOption)) as caught:
                call(nodes)
            assert caught.value.reason == reason


def test_what_has_no_derivative(client: ms.Client) -> None:
    with client.session(MESH) as session:
        with pytest.raises(ms.InvalidOption, match="movement limit"):
            session.vjp(BELOW, COTANGENTS, movement_limit=0.1)
        with pytest.raises(ms.InvalidOption, match="starts cold"):
            session.jvp(BELOW, TANGENTS, method=ms.Move(start="warm"))
        with pytest.raises(ms.InvalidOption):
            session.jvp(BELOW, TANGENTS, method="taubin")
    assert "move_derivative" in client.info().features
