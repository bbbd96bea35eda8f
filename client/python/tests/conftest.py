"""Servers and meshes that the tests share.

    MESHSMOOTH_SERVER_BINARY  the program meshsmooth-server
    MESHSMOOTH_CLI            the program meshsmooth

Tests that need a program or package which is missing are skipped with its name.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from typing import Any

import hypothesis
import numpy as np
import pytest

import meshsmooth as ms

hypothesis.settings.register_profile("here", database=None)  # no folder of examples in the sources
hypothesis.settings.load_profile("here")

# With these, a few thousand nodes keep a core busy for minutes: longer than any test that ends the
# job itself.
LONG: ms.JobOptions = {
    "method": ms.Laplacian(relaxation=0.05),
    "guard": False,
    "tolerance": 0,
    "iterations": 2_000_000_000,
}


def program(variable: str) -> str:
    path = os.environ.get(variable)
    if not path:
        pytest.skip(f"missing program: set {variable}")
    return path


@contextlib.contextmanager
def running_server(*arguments: str, listen: str = "") -> Iterator[str]:
    """A server on a socket of its own that serves; yields its address."""
    with tempfile.TemporaryDirectory(prefix="meshsmooth-") as folder:
        command = [
            program("MESHSMOOTH_SERVER_BINARY"),
            *("--listen", listen or f"unix:{folder}/socket"),
            *("--backend", "cpu", "--warm-up=false", "--log-format", "json"),
            *("--lame-duck-seconds", "0", "--drain-grace-seconds", "0"),
            *arguments,
        ]
        # A server that is killed leaves its sockets in the folder.
        environment = os.environ | {"TMPDIR": folder}
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
        assert process.stderr is not None
        try:
            start: dict[str, Any] = {}
            for line in process.stderr:
                with contextlib.suppress(json.JSONDecodeError):
                    start = json.loads(line)
                if start.get("event") == "start":
                    break
            assert start.get("event") == "start", "the server ended before it served"
            # A full pipe would stop the server.
            threading.Thread(target=process.stderr.read, daemon=True).start()
            yield f"127.0.0.1:{start['port']}" if listen else start["listen"]
        finally:
            process.kill()
            process.wait()


@pytest.fixture(scope="session")
def server() -> Iterator[str]:
    with running_server() as address:
        yield address


@pytest.fixture(scope="session")
def client(server: str) -> Iterator[ms.Client]:
    with ms.Client(server) as one:
        yield one


@pytest.fixture(autouse=True)
def _server_of_environment(request: pytest.FixtureRequest, monkeypatch: Any) -> None:
    """`ms.smooth` must never find a server that the test does not mean."""
    for name in list(os.environ):
        if name.startswith("MESHSMOOTH_CLIENT_"):
            monkeypatch.delenv(name)
    address = request.getfixturevalue("server") if "server" in request.fixturenames else "unix:/"
    # A test of local servers has a fixture `server` of its own.
    monkeypatch.setenv("MESHSMOOTH_SERVER", address if isinstance(address, str) else "unix:/")


def cube(count: int = 6, dtype: Any = np.float64, seed: int = 7) -> tuple[Any, dict[str, Any]]:
    """A cube of count³ nodes, its inner nodes shaken, as five tetrahedra a cell."""
    points = np.stack(np.meshgrid(*[np.arange(count)] * 3, indexing="ij"), -1).reshape(-1, 3)
    cell = points[(points < count - 1).all(axis=1)]
    corners = [
        np.ravel_multi_index((cell + offset).T, (count,) * 3)
        for offset in np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), -1).reshape(
            -1, 3
        )
    ]
    tetra = np.concatenate(
        [
            np.stack([corners[i] for i in corner], axis=1)
            for corner in (
                (0, 4, 6, 7),
                (0, 6, 2, 7),
                (0, 2, 3, 7),
                (0, 3, 1, 7),
                (0, 1, 5, 7),
                (0, 5, 4, 7),
            )
        ]
    )
    inner = ((points > 0) & (points < count - 1)).all(axis=1)
    shaken = points.astype(float)
    shaken[inner] += np.random.default_rng(seed).uniform(-0.3, 0.3, (int(inner.sum()), 3))
    return (shaken / (count - 1)).astype(dtype), {"tetra": tetra}


def run_cli(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [program("MESHSMOOTH_CLI"), *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
