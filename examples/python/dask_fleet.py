"""Many machines, one fleet: dask's workers send their meshes to the servers of one address.

Set MESHSMOOTH_SERVER to dns:///NAME:PORT for jobs to go to all servers behind that name; without it
each worker process has a server of its own.

Needs: dask, distributed
"""

from dask.distributed import Client, LocalCluster, as_completed


def smooth(seed: int) -> tuple[int, float]:
    """Runs in a worker, which holds one connection for all its tasks."""
    import numpy as np

    import meshsmooth as ms

    y, x = np.mgrid[0:20, 0:20] / 19
    first = (np.arange(19)[:, None] * 20 + np.arange(19)).reshape(-1, 1)
    points = np.stack([x, y], axis=-1)
    points[1:-1, 1:-1] += np.random.default_rng(seed).uniform(-0.02, 0.02, (18, 18, 2))
    result = ms.smooth(
        (points.reshape(-1, 2), {"quad": first + np.array([0, 1, 21, 20])}), full=True
    )
    return seed, result.summary.quality_after.metric("mean_ratio").min


if __name__ == "__main__":
    # A cluster on this machine; Client("tcp://scheduler:8786") for one on many. Workers are started
    # anew, not forked: a connection does not survive a fork.
    cluster = LocalCluster(n_workers=2, threads_per_worker=2, dashboard_address=None)
    with cluster, Client(cluster) as dask:
        for done in as_completed(dask.map(smooth, range(12))):
            seed, worst = done.result()
            print(f"mesh {seed}: worst mean ratio {worst:.2f}")
