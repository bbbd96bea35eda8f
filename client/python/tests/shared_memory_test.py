"""Meshes that travel in memory shared with the server."""

from __future__ import annotations

import asyncio
import gc
import os
import signal
import subprocess
import sys
import tempfile
from typing import Any

import numpy as np
import pytest
from conftest import cube, running_server
from local_server import eventually

import meshsmooth as ms
from meshsmooth import _call, _rpc

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs Linux")

OPTIONS: ms.JobOptions = {"method": "laplacian", "iterations": 2}


def square(count: int, dtype: Any) -> tuple[Any, dict[str, Any]]:
    """A plane square of count² nodes, its inner nodes shaken, as two triangles a cell."""
    grid = np.arange(count)
    points = np.stack(np.meshgrid(grid, grid, indexing="ij"), -1).reshape(-1, 2).astype(dtype)
    inner = ((points > 0) & (points < count - 1)).all(axis=1)
    points[inner] += np.random.default_rng(3).uniform(-0.3, 0.3, (int(inner.sum()), 2))
    first = (grid[:-1, None] * count + grid[:-1]).reshape(-1)
    halves = [(0, count, count + 1), (0, count + 1, 1)]
    return points, {"triangle": np.concatenate([first[:, None] + np.array(h) for h in halves])}


@pytest.fixture
def shares(monkeypatch: Any) -> list[bool]:
    """Whether each call that ended well went through shared memory."""
    calls: list[bool] = []
    receive = _call.SmoothCall.receive

    def noting(self: _call.SmoothCall, message: bytes) -> Any:
        progress = receive(self, message)
        if self.result.summary is not None:
            calls.append(self.transfer is not None)
        return progress

    monkeypatch.setattr(_call.SmoothCall, "receive", noting)
    return calls


def comes_to_share(client: ms.Client, shares: list[bool], mesh: Any, expected: Any) -> bool:
    """Whether jobs go through shared memory after some time; each has the right result."""

    def shared() -> bool:
        result = client.smooth(mesh, full=True, **OPTIONS)
        np.testing.assert_array_equal(result.points, expected)
        return shares[-1]

    return eventually(shared)


def reserved_bytes(client: ms.Client) -> int:
    return sum(int(backend.get("reserved_bytes", 0)) for backend in client.info().raw["backends"])


@pytest.mark.parametrize("index_type", [np.int32, np.int64])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_shares_memory_from_the_second_job_on(
    server: str, shares: list[bool], index_type: Any, dtype: Any
) -> None:
    points, cells = cube(12, dtype)
    mesh = (points, {"tetra": cells["tetra"].astype(index_type)})
    with ms.Client(server) as client:
        expected = client.smooth(mesh, full=True, **OPTIONS).points
        assert shares == [False]
        assert comes_to_share(client, shares, mesh, expected)


def test_sends_all_arrays_and_takes_the_quality_of_elements(
    server: str, shares: list[bool]
) -> None:
    points, cells = cube(12)
    fixed = np.zeros(len(points), bool)
    fixed[5] = True
    regions = np.arange(len(cells["tetra"])) % 2
    options: Any = OPTIONS | {
        "fixed": fixed,
        "regions": regions,
        "reference": points,
        "method": ms.Optimize(target="reference"),
        "element_quality": "mean_ratio",
    }
    with ms.Client(server) as client:
        first = client.smooth((points, cells), full=True, **options)

        def same() -> bool:
            again = client.smooth((points, cells), full=True, **options)
            np.testing.assert_array_equal(again.points, first.points)
            np.testing.assert_array_equal(
                again.element_quality["mean_ratio"], first.element_quality["mean_ratio"]
            )
            return shares[-1]

        assert eventually(same)


def test_shares_the_steps_of_a_session(server: str, shares: list[bool]) -> None:
    points, cells = cube(12)
    with ms.Client(server) as client, client.session((points, cells)) as session:

        def shared() -> bool:
            session.smooth(points, **OPTIONS)
            return shares[-1]

        assert eventually(shared)


@pytest.mark.parametrize("width", [2, 3])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_sessions_positions_stay_in_place(
    server: str, shares: list[bool], dtype: Any, width: int
) -> None:
    points, cells = cube(16, dtype) if width == 3 else square(60, dtype)
    step: Any = OPTIONS | {"iterations": 1}
    with ms.Client(server) as client, client.session((points, cells)) as session:
        assert np.array_equal(session.positions, points)
        expected = points
        for _ in range(8):
            before = session.positions
            expected = session.smooth(expected, **step)
            result = session.smooth(**step)
            assert result is session.positions is not before
            assert np.array_equal(result, expected)
            result += 0.25  # as a caller moves them
            expected += 0.25
        assert eventually(lambda: session.smooth(**step) is not None and shares[-1])
        kept = session.positions
        last = kept.copy()
        full = session.smooth(full=True, element_quality="mean_ratio", **step)
        assert full.mesh is session.positions
        assert np.array_equal(kept, last)  # the result is elsewhere
        assert len(full.element_quality["mean_ratio"]) == len(next(iter(cells.values())))
    assert np.array_equal(kept, last)


def test_a_sessions_positions_outlive_a_failure(server: str, shares: list[bool]) -> None:
    points, cells = cube(12)
    with ms.Client(server) as client, client.session((points, cells)) as session:
        assert eventually(lambda: session.smooth(**OPTIONS) is not None and shares[-1])
        session.positions[5] = np.nan
        before = session.positions.copy()
        with pytest.raises(ms.InvalidMesh):
            session.smooth(**OPTIONS)
        assert np.array_equal(session.positions, before, equal_nan=True)
        session.positions[5] = points[5]
        assert eventually(lambda: session.smooth(**OPTIONS) is not None and shares[-1])
        with pytest.raises(ms.InvalidOption):
            session.smooth(out=points, **OPTIONS)


def test_shares_memory_on_asyncio(server: str, shares: list[bool]) -> None:
    points, cells = cube(12)

    async def steps() -> None:
        async with ms.AsyncClient(server) as client:
            expected = (await client.smooth((points, cells), **OPTIONS))[0]
            for _ in range(200):
                result, _ = await client.smooth((points, cells), **OPTIONS)
                assert np.array_equal(result, expected)
                if shares[-1]:
                    break
                await asyncio.sleep(0.01)
            assert shares[-1]
            async with client.session((points, cells)) as session:
                assert np.array_equal(await session.smooth(**OPTIONS), expected)
                assert np.array_equal(session.positions, expected)

    asyncio.run(steps())


def test_goes_on_when_the_server_is_another(shares: list[bool]) -> None:
    points, cells = cube(12)
    with tempfile.TemporaryDirectory(prefix="meshsmooth-") as folder:
        listen = f"unix:{folder}/socket"
        with running_server(listen=listen):
            client = ms.Client(listen)
            expected = client.smooth((points, cells), full=True, **OPTIONS).points
            assert comes_to_share(client, shares, (points, cells), expected)
        with running_server(listen=listen):
            result = client.smooth((points, cells), full=True, **OPTIONS)
            # In chunks, or in memory of the new server if this was a second attempt.
            np.testing.assert_array_equal(result.points, expected)
            assert comes_to_share(client, shares, (points, cells), expected)
            client.close()


def test_has_no_segment_where_the_server_shares_none(shares: list[bool]) -> None:
    points, cells = cube(12)
    with running_server("--shared-memory-socket", "") as address, ms.Client(address) as client:
        for _ in range(5):
            client.smooth((points, cells), **OPTIONS)
        assert not any(shares)


def test_refused_jobs_raise_as_ever(server: str, shares: list[bool]) -> None:
    points, cells = cube(12)
    with ms.Client(server) as client:
        expected = client.smooth((points, cells), full=True, **OPTIONS).points
        assert comes_to_share(client, shares, (points, cells), expected)
        bad = points.copy()
        bad[7] = np.nan
        with pytest.raises(ms.InvalidMesh) as error:
            client.smooth((bad, cells), max_attempts=1, **OPTIONS)
        assert error.value.reason == "NON_FINITE_COORDINATE"
        assert comes_to_share(client, shares, (points, cells), expected)


def test_returns_its_segment_when_it_is_closed_or_forgotten(shares: list[bool]) -> None:
    points, cells = cube(12)
    with running_server() as address, ms.Client(address) as other:
        for forget in (ms.Client.close, lambda client: None):
            client = ms.Client(address)
            expected = client.smooth((points, cells), full=True, **OPTIONS).points
            assert comes_to_share(client, shares, (points, cells), expected)
            assert reserved_bytes(other) > 0
            forget(client)
            del client
            gc.collect()
            assert eventually(lambda: reserved_bytes(other) == 0)


# Not in a process that uses gRPC, which may not fork.
FORKING = """
import os, sys, time
from meshsmooth._shared_memory import Segment
from meshsmooth.v1 import smoothing_pb2 as pb

print("ready", flush=True)  # a ticket lasts seconds
segment = Segment(pb.LeaseSharedMemoryResponse.FromString(bytes.fromhex(sys.stdin.readline())))
child = os.fork()
if child == 0:
    time.sleep(600)
print(child, flush=True)
segment.close()
sys.stdin.read()
"""


def test_a_forked_child_does_not_keep_it() -> None:
    with running_server() as address, ms.Client(address) as client:
        process = subprocess.Popen(
            [sys.executable, "-c", FORKING],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        lease = client._ask(_rpc.LEASE_SHARED_MEMORY, size_bytes=1)
        process.stdin.write(lease.SerializeToString().hex() + "\n")
        process.stdin.flush()
        child = int(process.stdout.readline())
        try:
            assert eventually(lambda: reserved_bytes(client) == 0)
        finally:
            os.kill(child, signal.SIGKILL)
            process.stdin.close()
            process.wait()
            process.stdout.close()
