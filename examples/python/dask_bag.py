"""A data set of many small meshes, of which some are bad: each partition goes by `smooth_many`.

Needs: dask, distributed
"""

from collections.abc import Iterable
from typing import Any

import dask.bag
import numpy as np
from dask.distributed import Client, LocalCluster

import meshsmooth as ms

SIDE = 8


def make_mesh(seed: int) -> Any:
    """A square of quads whose inner nodes are displaced; one mesh in ten lacks a position."""
    points = np.stack(np.mgrid[0:SIDE, 0:SIDE][::-1], axis=-1) / (SIDE - 1)
    points[1:-1, 1:-1] += np.random.default_rng(seed).uniform(-0.05, 0.05, (SIDE - 2, SIDE - 2, 2))
    if seed % 10 == 7:
        points[3, 3] = np.nan
    first = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).reshape(-1, 1)
    return points.reshape(-1, 2), {"quad": first + np.array([0, 1, SIDE + 1, SIDE])}


def smooth(meshes: Iterable[Any]) -> list[str]:
    """Runs in a worker, on one partition."""
    results = ms.smooth_many(meshes, full=True)
    return [str(r) if isinstance(r, Exception) else r.summary.stop_reason for r in results]


if __name__ == "__main__":
    cluster = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with cluster, Client(cluster):
        meshes = dask.bag.from_sequence(range(200), npartitions=4).map(make_mesh)
        for what, count in meshes.map_partitions(smooth).frequencies().compute():
            print(f"{count} meshes: {what}")
