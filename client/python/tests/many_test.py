"""Many meshes by one call: in order, each as it is alone, and a bad one fails alone."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from conftest import LONG, cube, running_server

import meshsmooth as ms

GOOD = [cube(2 + seed % 4, seed=seed) for seed in range(12)]
# Of 13³ nodes, as large as those that a thread of its own sends.
LARGE = cube(13)
POINTS, CELLS = cube(4)
NAN = np.where(POINTS == 0, np.nan, POINTS)
BAD: list[tuple[Any, type[Exception], str]] = [
    ((NAN, CELLS), ms.InvalidMesh, "node 0: its position"),
    ((POINTS, {"tets": CELLS["tetra"]}), ms.InvalidMesh, "unknown type 'tets'"),
    ((POINTS, {"tetra": CELLS["tetra"] + 10**6}), ms.InvalidMesh, "is out of range"),
    (17, TypeError, "meshes of the type builtins.int are not known"),
]


def with_asyncio(client: ms.Client, meshes: Any, **keywords: Any) -> Iterator[Any]:
    async def collect() -> list[Any]:
        async with ms.AsyncClient(client.address) as other:
            return [result async for result in other.smooth_many(meshes, **keywords)]

    return iter(asyncio.run(collect()))


def with_function(_: ms.Client, meshes: Any, **keywords: Any) -> Iterator[Any]:
    return ms.smooth_many(meshes, **keywords)


Call = Callable[..., Iterator[Any]]
CALLS = pytest.mark.parametrize("many", [ms.Client.smooth_many, with_function, with_asyncio])


@CALLS
@pytest.mark.usefixtures("server")
def test_a_bad_mesh_fails_alone(client: ms.Client, many: Call) -> None:
    meshes = [*GOOD[:6], BAD[0][0], LARGE, BAD[1][0], *GOOD[6:], BAD[2][0], BAD[3][0]]
    results = list(many(client, meshes, goal="worst"))
    assert len(results) == len(meshes)
    for mesh, result in zip(meshes, results, strict=True):
        expected = next((bad[1:] for bad in BAD if bad[0] is mesh), None)
        if expected is None:
            assert result[0].tobytes() == client.smooth(mesh, goal="worst")[0].tobytes()
        else:
            assert type(result) is expected[0]
            assert expected[1] in str(result)


@CALLS
@pytest.mark.usefixtures("server")
def test_each_mesh_ends_by_its_own_rule(client: ms.Client, many: Call) -> None:
    alone = [client.smooth(mesh, full=True).summary for mesh in GOOD]
    together = [result.summary for result in many(client, GOOD, full=True, max_in_flight=5)]
    assert [s.convergence.iteration_count for s in together] == [
        s.convergence.iteration_count for s in alone
    ]
    assert len({s.convergence.iteration_count for s in together}) > 1


def test_results_stream_and_meshes_are_taken_as_needed(client: ms.Client) -> None:
    taken = 0

    def endless() -> Iterator[Any]:
        nonlocal taken
        while True:
            taken += 1
            yield GOOD[1]

    results = client.smooth_many(endless())
    for done in range(1, 200):
        next(results)
        assert taken <= done + 64
    results.close()  # type: ignore[attr-defined]


@pytest.mark.parametrize("kind", [tuple, list, iter])
def test_meshes_may_be_in_any_iterable(client: ms.Client, kind: Any) -> None:
    for count in (2, 3):  # as many as arrays in one mesh
        results = list(client.smooth_many(kind(GOOD[1 : 1 + count])))
        assert [len(points) for points, _ in results] == [len(m[0]) for m in GOOD[1 : 1 + count]]


def test_map_raises_in_the_place_of_the_mesh(client: ms.Client) -> None:
    results = client.map([GOOD[2], GOOD[3], BAD[1][0], GOOD[4]])
    assert next(results)[0].tobytes() == client.smooth(GOOD[2])[0].tobytes()
    assert next(results)[0].tobytes() == client.smooth(GOOD[3])[0].tobytes()
    with pytest.raises(ms.InvalidMesh, match="unknown type 'tets'"):
        next(results)


@pytest.mark.parametrize("mesh", [GOOD[3], LARGE], ids=["small", "large"])
def test_what_concerns_all_meshes_is_raised(mesh: Any) -> None:
    with ms.Client("unix:/nowhere/socket") as client, pytest.raises(ms.Unavailable):
        list(client.smooth_many([mesh] * 3, timeout=0.5))


def test_a_job_that_ends_too_late_fails_alone() -> None:
    with running_server("--lanes", "2") as address, ms.Client(address) as client:
        slow = (LARGE[0], LARGE[1])
        first, *_ = client.smooth_many([slow], timeout=0.2, **LONG)
        assert isinstance(first, ms.DeadlineExceeded)
        assert not isinstance(next(client.smooth_many([GOOD[3]])), Exception)
