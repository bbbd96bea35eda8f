"""Why an element is not better, and what changed, as a picture."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from conftest import cube

import meshsmooth as ms

pytestmark = pytest.mark.usefixtures("server")

POINTS, CELLS = cube()
TETRA = CELLS["tetra"]
ON_BOUNDARY = ((POINTS == 0) | (POINTS == 1)).any(axis=1)
LOCKED = int(np.flatnonzero(ON_BOUNDARY[TETRA].all(axis=1))[0])


def test_locked() -> None:
    told = ms.why((POINTS, CELLS), LOCKED)
    assert (told.reason, told.free_node_count) == ("locked", 0)
    assert told.nodes == tuple(TETRA[LOCKED])
    assert told.best_mean_ratio == told.mean_ratio
    assert str(told).startswith(f"cell {LOCKED}, mean ratio ")
    assert "locked: all its nodes are fixed" in str(told)


def test_improvable_and_limited() -> None:
    result = ms.smooth((POINTS, CELLS), full=True, element_quality="mean_ratio")
    inner = np.flatnonzero(~ON_BOUNDARY[TETRA].any(axis=1))
    start = ms.quality((POINTS, CELLS)).worst_elements
    worst = next(e.element for e in start if not ON_BOUNDARY[TETRA[e.element]].all())
    told = ms.why((POINTS, CELLS), worst)
    assert told.reason == "improvable"
    assert told.best_mean_ratio > told.mean_ratio
    best = inner[np.argmax(result.element_quality["mean_ratio"][inner])]
    at_the_optimum = ms.why(result.mesh, int(best))
    assert at_the_optimum.reason in ("limited", "improvable")
    assert at_the_optimum.best_mean_ratio < at_the_optimum.mean_ratio + 0.05
    held = ms.why((POINTS, CELLS), worst, fixed=TETRA[worst])
    assert held.reason == "locked"


def test_cells_count_through_all_blocks() -> None:
    mesh = (POINTS, [("line", TETRA[:2, :2]), ("tetra", TETRA)])
    assert ms.why(mesh, LOCKED + 2).nodes == tuple(TETRA[LOCKED])
    with pytest.raises(ms.InvalidOption, match="cell 1 is not an element"):
        ms.why(mesh, 1)
    with pytest.raises(ms.InvalidOption, match="cell 752 is not in the mesh of 752 cells"):
        ms.why(mesh, 752)


def test_plots_before_and_after() -> None:
    pyvista: Any = pytest.importorskip("pyvista", reason="missing package: pyvista")
    pyvista.OFF_SCREEN = True
    result = ms.smooth((POINTS, CELLS), full=True)
    plotter = result.plot(show=False)
    assert plotter.shape == (1, 2)
    assert plotter.renderers[0].camera is plotter.renderers[1].camera
    with pytest.raises(ValueError, match="left behind by pickle"):
        pickle.loads(pickle.dumps(result)).plot(show=False)
    points = POINTS.copy()
    with pytest.raises(ValueError, match="overwritten"):
        ms.smooth((points, CELLS), out=points, full=True).plot(show=False)
    assert repr(result) == "<meshsmooth.SmoothResult: tuple of 216 nodes, converged>"
