"""Many meshes, a few in flight at a time; the iterator may make or read them as it goes.

Needs: numpy
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

import meshsmooth as ms

SIDE = 20


def meshes(count: int) -> Iterator[tuple[Any, Any]]:
    """Quads of the unit square, their inner nodes displaced at random."""
    y, x = np.mgrid[0:SIDE, 0:SIDE] / (SIDE - 1)
    first = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).reshape(-1, 1)
    for seed in range(count):
        points = np.stack([x, y], axis=-1)
        random = np.random.default_rng(seed).uniform(-0.4, 0.4, points.shape) / SIDE
        points[1:-1, 1:-1] += random[1:-1, 1:-1]
        yield points.reshape(-1, 2), {"quad": first + np.array([0, 1, SIDE + 1, SIDE])}


for number, result in enumerate(ms.default_client().map(meshes(20), max_in_flight=4, full=True)):
    before = result.summary.quality_before.metric("mean_ratio")
    after = result.summary.quality_after.metric("mean_ratio")
    print(f"mesh {number}: worst {before.min:.2f} -> {after.min:.2f}")
