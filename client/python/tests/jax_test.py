"""Motions in JAX: its own check of gradients, and its transformations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from conftest import cube

import meshsmooth as ms

jax: Any = pytest.importorskip("jax", reason="missing package: jax")
from jax.test_util import check_grads  # noqa: E402

from meshsmooth import jax as ms_jax  # noqa: E402

jax.config.update("jax_enable_x64", True)

MESH = cube(4)
POINTS = MESH[0]
BELOW = (POINTS[:, 2] == 0).nonzero()[0]
RANDOM = np.random.default_rng(5)
U = RANDOM.standard_normal((len(BELOW), 3))
W = RANDOM.standard_normal(POINTS.shape)


@pytest.fixture(params=["fixed", "slide", "free"])
def session(client: ms.Client, request: Any) -> Iterator[ms.Session]:
    with client.session(MESH, boundary=request.param) as opened:
        yield opened


def test_check_grads(session: ms.Session) -> None:
    # Linear: central differences of any length are exact but for rounding.
    check_grads(
        lambda u: ms_jax.predict(session, BELOW, u), (U,), order=2, eps=1.0, atol=1e-9, rtol=1e-9
    )


def test_move_has_the_derivatives_of_the_prediction(session: ms.Session) -> None:
    positions = POINTS[BELOW] + [0, 0, -0.1]
    moved, pull_back = jax.vjp(lambda x: ms_jax.move(session, BELOW, x), positions)
    assert (moved == session.move(BELOW, positions)).all()
    assert (pull_back(W)[0] == session.vjp(BELOW, W)).all()
    again, tangent = jax.jvp(lambda x: ms_jax.move(session, BELOW, x), (positions,), (U,))
    assert (again == moved).all()
    assert (tangent == session.jvp(BELOW, U)).all()


def test_transformations(session: ms.Session) -> None:
    def scalar(u: Any) -> Any:
        return (ms_jax.predict(session, BELOW, u) * W).sum()

    expected = session.vjp(BELOW, W)
    assert (jax.grad(scalar)(U) == expected).all()
    assert (jax.jit(jax.grad(scalar))(U) == expected).all()
    several = jax.vmap(lambda u: ms_jax.move(session, BELOW, u))(
        np.stack([POINTS[BELOW], POINTS[BELOW] + [0, 0, -0.1]])
    )
    assert (several[0] == session.move(BELOW, POINTS[BELOW])).all()
    assert several.shape == (2, *POINTS.shape)


def test_positions_of_all_nodes(session: ms.Session) -> None:
    mask = POINTS[:, 2] == 0
    gradient = jax.grad(lambda x: (ms_jax.move(session, mask, x) * W).sum())(POINTS)
    assert (gradient[~mask] == 0).all()
    assert (gradient[BELOW] == session.vjp(BELOW, W)).all()
