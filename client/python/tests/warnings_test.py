"""Who takes the mesh alone hears of what is wrong with it, at his own line."""

from __future__ import annotations

import asyncio
import concurrent.futures
import inspect
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from conftest import cube

import meshsmooth as ms

POINTS, CELLS = cube()
# A fixed node inside, beyond the opposite side of its elements: they stay inverted.
INNER = int(np.flatnonzero(((POINTS > 0) & (POINTS < 1)).all(axis=1))[0])
STUCK = POINTS.copy()
STUCK[INNER] = 0.95
TANGLED = (STUCK, CELLS)
TOO_FAR = np.where(POINTS == 1, -1.0, 0.0)


def here() -> int:
    frame = inspect.currentframe()
    assert frame is not None
    assert frame.f_back is not None
    return frame.f_back.f_lineno


async def awaited(client: ms.AsyncClient, how: str) -> int:
    if how == "submit":
        job = await client.submit(TANGLED, fixed=[INNER])
        line = here() + 1
        await job
    else:
        line = here() + 1
        await client.smooth(TANGLED, fixed=[INNER])
    return line


def with_asyncio(how: str) -> Callable[[ms.Client], int]:
    def run(client: ms.Client) -> int:
        async def main() -> int:
            async with ms.AsyncClient(client.address) as other:
                return await awaited(other, how)

        return asyncio.run(main())

    return run


def with_function(_: ms.Client) -> int:
    ms.smooth(TANGLED, fixed=[INNER])
    return here() - 1


def with_client(client: ms.Client) -> int:
    client.smooth(TANGLED, fixed=[INNER])
    return here() - 1


def with_job(client: ms.Client) -> int:
    job = client.submit(TANGLED, fixed=[INNER])
    job.result(60)
    return here() - 1


def with_map(client: ms.Client) -> int:
    list(client.map([TANGLED], fixed=[INNER]))
    return here() - 1


def with_session(client: ms.Client) -> int:
    with client.session(TANGLED, fixed=[INNER]) as session:
        session.smooth(STUCK, quality="brief")
        return here() - 1


@pytest.mark.parametrize(
    "call",
    [
        *(with_function, with_client, with_job, with_map, with_session),
        *(with_asyncio("smooth"), with_asyncio("submit")),
    ],
)
@pytest.mark.usefixtures("server")
def test_a_tangled_result_is_a_warning_at_the_callers_line(
    client: ms.Client, call: Callable[[ms.Client], int]
) -> None:
    with pytest.warns(RuntimeWarning, match=r"\d+ of 750 elements .* inverted; \d+ were") as caught:
        line = call(client)
    ours = [entry for entry in caught if entry.category is RuntimeWarning]
    assert [(entry.filename, entry.lineno) for entry in ours] == [(__file__, line)]


def test_a_motion_that_falls_short_too(client: ms.Client) -> None:
    mesh = client.smooth((POINTS, CELLS))
    with pytest.warns(RuntimeWarning, match="move reached .* % of the motion;") as caught:
        client.move(mesh, displacement=TOO_FAR)
    assert caught[0].filename == __file__


def test_no_warning_without_a_cause(client: ms.Client) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        client.smooth((POINTS, CELLS))
        result = client.smooth(TANGLED, fixed=[INNER], full=True)  # says it in the summary
    assert result.summary.quality_after.inverted_element_count > 0


def test_jobs_are_futures(client: ms.Client) -> None:
    jobs: list[Any] = [client.submit((POINTS, CELLS)) for _ in range(3)]
    assert set(concurrent.futures.as_completed(jobs, 60)) == set(jobs)
    done, waiting = concurrent.futures.wait(jobs, 60)
    assert (len(done), len(waiting)) == (3, 0)
