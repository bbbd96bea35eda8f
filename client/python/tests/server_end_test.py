"""What calls do when the local server of this process dies under them."""

from __future__ import annotations

import asyncio
import os
import pathlib
import signal
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from conftest import LONG, cube
from local_server import children_of, eventually, is_running, program

import meshsmooth as ms
from meshsmooth import _local

MESH = cube()


@pytest.fixture(autouse=True)
def own_server(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """`ms.smooth` starts a server, which ends with the test."""
    program()
    monkeypatch.delenv("MESHSMOOTH_SERVER")
    yield
    if _local._default is not None:
        _local._default.close()


def server_pid() -> int:
    process = _local.default_server()._process
    assert process is not None
    return process._process.pid


def end_server(how: signal.Signals) -> None:
    pid = server_pid()
    os.kill(pid, how)
    # It may answer one more small job before the signal is delivered.
    assert eventually(lambda: not is_running(pid))


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGSEGV])
def test_the_next_call_uses_another_server(how: signal.Signals) -> None:
    client = ms.Client()
    expected = ms.smooth(MESH)[0].tobytes()
    assert client.info().version
    end_server(how)
    assert ms.smooth(MESH)[0].tobytes() == expected
    end_server(how)
    assert ms.quality(MESH).element_count == len(MESH[1]["tetra"])
    end_server(how)
    assert client.info().version


def kill_when_iterating(killed: list[int], most: int) -> Any:
    def progress(report: ms.Progress) -> None:
        if report.iteration > 0 and len(killed) < most and server_pid() not in killed:
            killed.append(server_pid())
            os.kill(killed[-1], signal.SIGKILL)

    return progress


def test_a_job_is_sent_again_once() -> None:
    killed: list[int] = []
    budget: ms.JobOptions = {**LONG, "compute_budget": 0.5}
    ms.smooth(cube(14), progress=kill_when_iterating(killed, 1), **budget)
    assert len(killed) == 1
    with pytest.raises(ms.Unavailable, match="was ended by SIGKILL") as caught:
        ms.smooth(cube(14), progress=kill_when_iterating(killed, 9), **LONG)
    assert len(killed) == 3
    assert caught.value.reason == "SERVER_ENDED"
    assert "last log lines" in str(caught.value)
    assert "another" in caught.value.hint


def test_asyncio_and_sessions_too() -> None:
    async def steps() -> None:
        async with ms.AsyncClient() as client:
            first = await client.smooth(MESH)
            os.kill(server_pid(), signal.SIGKILL)
            assert np.array_equal((await client.smooth(MESH))[0], first[0])

    asyncio.run(steps())
    large = cube(20)
    with ms.Client().session(large) as session:
        first = session.smooth(large[0])
        session.smooth()
        os.kill(server_pid(), signal.SIGKILL)
        assert np.array_equal(session.smooth(large[0]), first)
        session.smooth()


def test_an_asyncio_client_serves_another_loop() -> None:
    client = ms.AsyncClient()
    first = asyncio.run(client.smooth(MESH))
    assert np.array_equal(asyncio.run(client.smooth(MESH))[0], first[0])


def test_a_named_server_is_not_replaced() -> None:
    with ms.LocalServer() as server, ms.Client(server.address) as client:
        client.smooth(MESH)
        assert server._process is not None
        server._process._process.kill()
        with pytest.raises(ms.Unavailable, match="was ended by SIGKILL") as caught:
            client.smooth(MESH)
        assert not caught.value.hint


def test_threads_share_the_next_server() -> None:
    ms.smooth(MESH)
    before = children_of(os.getpid())
    budget: ms.JobOptions = {**LONG, "compute_budget": 1.0}
    started = threading.Barrier(5)
    failures: list[BaseException] = []

    def work() -> None:
        waiting = [True]

        def progress(report: ms.Progress) -> None:
            if report.state in ("queued", "running") and waiting:
                waiting.clear()
                started.wait(60)

        try:
            ms.smooth(cube(14), progress=progress, **budget)
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    started.wait(60)
    os.kill(server_pid(), signal.SIGKILL)
    for thread in threads:
        thread.join()
    assert not failures
    assert len(children_of(os.getpid())) == len(before)


def test_nothing_stays_of_a_server_that_crashed(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sockets of calls and of shared memory are in one folder."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    large = cube(20)
    client = ms.Client()
    for _ in range(3):
        client.smooth(large)
    assert len(list(tmp_path.glob("meshsmooth-*"))) == 1
    server = _local.default_server()
    os.kill(server_pid(), signal.SIGKILL)
    assert server.failure(60)
    assert not list(tmp_path.glob("meshsmooth-*"))
