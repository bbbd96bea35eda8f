"""What a mesh of 5 nodes costs from Python: one after another, and by `map`.

    PYTHONPATH=client/python/src MESHSMOOTH_SERVER_BINARY=build/release/server/meshsmooth-server \\
        python3 tests/bench/tiny_mesh.py

With the sources of another commit first in PYTHONPATH, it measures those.
"""

from __future__ import annotations

import argparse
import asyncio
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import meshsmooth as ms

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.1, 0.1]])
MESH = (POINTS, {"tetra": np.array([[4, 1, 2, 3], [0, 4, 2, 3], [0, 1, 4, 3], [0, 1, 2, 4]])})


def median_ms(call: Callable[[], Any], count: int) -> float:
    """The median of the times of a call, after some to warm up."""
    times = []
    for _ in range(count + 50):
        begin = time.perf_counter()
        call()
        times.append(1e3 * (time.perf_counter() - begin))
    return statistics.median(times[50:])


async def asyncio_ms(count: int) -> float:
    """The same of a call of the asyncio client."""
    async with ms.AsyncClient() as client:
        times = []
        for _ in range(count + 50):
            begin = time.perf_counter()
            await client.smooth(MESH)
            times.append(1e3 * (time.perf_counter() - begin))
        return statistics.median(times[50:])


def main() -> None:
    """Measures and prints a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=500)
    count = parser.parse_args().count
    client = ms.Client()
    print(f"smooth: {median_ms(lambda: client.smooth(MESH), count):.2f} ms")
    session = client.session(MESH)
    print(f"step of a session: {median_ms(lambda: session.smooth(POINTS), count):.2f} ms")
    print(f"smooth on asyncio: {asyncio.run(asyncio_ms(count)):.2f} ms")
    rates = []
    for _ in range(5):
        begin = time.perf_counter()
        done = sum(1 for _ in client.map([MESH] * count))
        rates.append(done / (time.perf_counter() - begin))
    print(f"map: {statistics.median(rates):.0f} meshes a second")


main()
