"""Coincident nodes that are smoothed as one."""

from __future__ import annotations

from typing import Any

import numpy as np
from conftest import cube

import meshsmooth as ms

POINTS, CELLS = cube(5)
SOUP = POINTS[CELLS["tetra"]].reshape(-1, 3)
OWN = {"tetra": np.arange(len(SOUP)).reshape(-1, 4)}
OUTER = ((SOUP == 0) | (SOUP == 1)).any(axis=1)


def expect_together(points: Any) -> None:
    _, place = np.unique(SOUP, axis=0, return_inverse=True)
    together = np.empty((place.max() + 1, 3))
    together[place.reshape(-1)] = points
    assert np.array_equal(together[place.reshape(-1)], points)


def test_separate_elements_are_smoothed(client: ms.Client) -> None:
    stuck = client.smooth((SOUP, OWN), full=True)
    assert np.array_equal(stuck.points, SOUP)
    assert "merge_coincident=True" in str(stuck)
    result = client.smooth((SOUP, OWN), merge_coincident=True, full=True)
    expect_together(result.points)
    assert (result.points != SOUP).any(axis=1).sum() > 100
    assert np.array_equal(result.points[OUTER], SOUP[OUTER])
    before, after = result.summary.quality_before, result.summary.quality_after
    assert after.inverted_element_count == 0
    means = [
        next(stats.mean for stats in quality.metrics if stats.metric == "mean_ratio")
        for quality in (before, after)
    ]
    assert means[0] < means[1]


def test_fixed_ones_fix_all_at_their_position(client: ms.Client) -> None:
    inner = int(np.flatnonzero(~OUTER)[-1])
    points = client.smooth((SOUP, OWN), merge_coincident=True, fixed=[inner])[0]
    same = (SOUP[inner] == SOUP).all(axis=1)
    assert same.sum() > 1
    assert np.array_equal(points[same], SOUP[same])


def test_sessions_and_motions(client: ms.Client) -> None:
    displacement = 0.05 * np.sin(3 * SOUP[:, [1, 2, 0]])
    moved = client.move((SOUP, OWN), displacement=displacement, merge_coincident=True)[0]
    expect_together(moved)
    assert np.allclose(moved[OUTER], (SOUP + displacement)[OUTER])
    with client.session((SOUP, OWN), merge_coincident=True) as session:
        expect_together(session.smooth(SOUP))
        again = session.move(OUTER, (SOUP + displacement)[OUTER])
        expect_together(again)
        assert np.allclose(again, moved)
