"""Motions in PyTorch: its own checks of gradients, and tensors as they come."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from conftest import cube

import meshsmooth as ms

torch: Any = pytest.importorskip("torch", reason="missing package: torch")
from meshsmooth import torch as ms_torch  # noqa: E402

MESH = cube(4)
POINTS = MESH[0]
BELOW = (POINTS[:, 2] == 0).nonzero()[0]
RANDOM = np.random.default_rng(5)


def displacements() -> Any:
    return torch.tensor(RANDOM.standard_normal((len(BELOW), 3)), requires_grad=True)


@pytest.fixture(params=["fixed", "slide", "free"])
def session(client: ms.Client, request: Any) -> Iterator[ms.Session]:
    with client.session(MESH, boundary=request.param) as opened:
        yield opened


def test_gradcheck(session: ms.Session) -> None:
    def predict(u: Any) -> Any:
        return ms_torch.predict(session, BELOW, u)

    # Linear: central differences of any length are exact but for rounding.
    checks = {"eps": 1.0, "atol": 1e-9, "rtol": 1e-9}
    assert torch.autograd.gradcheck(predict, displacements(), check_forward_ad=True, **checks)
    # The cotangent's own derivatives, too.
    assert torch.autograd.gradgradcheck(predict, displacements(), **checks)


def test_move_has_the_derivatives_of_the_prediction(session: ms.Session) -> None:
    positions = torch.tensor(POINTS[BELOW] + [0, 0, -0.1], requires_grad=True)
    moved = ms_torch.move(session, BELOW, positions)
    assert (moved.detach().numpy() == session.move(BELOW, positions.detach().numpy())).all()
    w = RANDOM.standard_normal(POINTS.shape)
    moved.backward(torch.tensor(w))
    assert (positions.grad.numpy() == session.vjp(BELOW, w)).all()
    u = torch.tensor(RANDOM.standard_normal((len(BELOW), 3)))
    with torch.autograd.forward_ad.dual_level():
        dual = torch.autograd.forward_ad.make_dual(positions.detach(), u)
        tangent = torch.autograd.forward_ad.unpack_dual(ms_torch.move(session, BELOW, dual)).tangent
    assert (tangent.numpy() == session.jvp(BELOW, u.numpy())).all()


def test_results_stay_as_they_were(session: ms.Session) -> None:
    first = ms_torch.move(session, BELOW, torch.tensor(POINTS[BELOW] + [0, 0, -0.1]))
    kept = first.clone()
    ms_torch.move(session, BELOW, torch.tensor(POINTS[BELOW] + [0, 0, 0.1]))
    assert (first == kept).all()


def test_positions_of_all_nodes(session: ms.Session) -> None:
    everywhere = torch.tensor(POINTS + [0, 0, -0.1], requires_grad=True)
    mask = POINTS[:, 2] == 0
    for nodes in (mask, BELOW, torch.tensor(mask)):
        moved = ms_torch.move(session, nodes, everywhere)
        assert (moved[BELOW] == everywhere[BELOW]).all()
        (gradient,) = torch.autograd.grad(moved.sum(), everywhere)
        assert (gradient[~mask] == 0).all()
        assert (gradient[BELOW].numpy() == session.vjp(BELOW, np.ones_like(POINTS))).all()


def test_all_nodes_in_an_order_of_their_own(client: ms.Client) -> None:
    order = RANDOM.permutation(len(POINTS))
    with client.session(MESH) as session:
        moved = ms_torch.move(session, order, torch.tensor(POINTS[order] * 1.1))
    assert np.abs(moved.numpy() - POINTS * 1.1).max() < 1e-12


def test_single_precision_stays(session: ms.Session) -> None:
    u = displacements().detach().float().requires_grad_()
    moved = ms_torch.predict(session, BELOW, u)
    assert moved.dtype == torch.float32
    moved.sum().backward()
    assert u.grad.dtype == torch.float32


def test_a_shape_is_found(client: ms.Client) -> None:
    """Newton's step of a quadratic objective ends at its optimum, as the derivatives are exact."""
    u = torch.zeros((len(BELOW), 3), dtype=torch.float64, requires_grad=True)
    goal = torch.tensor(RANDOM.standard_normal((len(BELOW), 3)))
    with client.session(MESH) as session:
        wanted = ms_torch.predict(session, BELOW, goal)
        optimizer = torch.optim.LBFGS([u], max_iter=50, tolerance_change=0, tolerance_grad=1e-12)

        def loss() -> Any:
            optimizer.zero_grad()
            value = (ms_torch.predict(session, BELOW, u) - wanted).square().sum()
            value.backward()
            return value

        optimizer.step(loss)
    assert (u - goal).abs().max() < 1e-6


def test_errors_arrive(session: ms.Session) -> None:
    u = displacements().detach()
    with pytest.raises(ms.InvalidMesh) as caught:
        ms_torch.predict(session, BELOW, u * np.nan)
    assert caught.value.reason == "NON_FINITE_COORDINATE"
    with pytest.raises(ms.InvalidMesh) as caught:
        ms_torch.move(session, BELOW, u[:-1])
    assert caught.value.reason == "ARRAY_SIZE_MISMATCH"
