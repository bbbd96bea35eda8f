"""The clients that a scenario is played to, and the outcomes that their users see."""

from __future__ import annotations

import asyncio
import os
import pathlib
import re
import subprocess
import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

import meshsmooth as ms
from scenario import TETRA, Points, Scenario, expected_motion

HANGS_AFTER = 120  # seconds; far more than any scenario takes
INCOMPLETE = 6  # exit code: a result that is short of what was asked for
# The calls that are sessions, and the variables of the examples that have those of C++.
SESSIONS = {"session": "MESHSMOOTH_MOVING_MESH", "motion": "MESHSMOOTH_MOVING_BOUNDARY"}


class Outcome(NamedTuple):
    """What a user sees: positions, perhaps with a warning, or an error by its reason and text."""

    result: Points | None = None
    reason: str = ""
    message: str = ""
    kind: str | int = ""  # the class in Python, the exit code of a program


def _of_error(error: ms.Error) -> Outcome:
    return Outcome(None, error.reason, str(error), type(error).__name__)


def python(scenario: Scenario, address: str, _: pathlib.Path) -> Outcome:
    """`ms.Client`."""
    mesh = (scenario.points.copy(), {"tetra": TETRA})
    try:
        with ms.Client(address, token_file=scenario.token_file) as client:
            if scenario.client["call"] == "attach":
                job = client.attach(scenario.client["job"], mesh, **scenario.options)
                return Outcome(job.result()[0])
            if scenario.client["call"] == "session":
                with client.session(mesh) as session:
                    for _step in range(scenario.client["steps"]):
                        result = session.smooth(scenario.points, **scenario.options)
                    return Outcome(result)
            moved = expected_motion(scenario.points)
            if scenario.client["call"] == "motion":
                with client.session(mesh) as session:
                    for _step in range(scenario.client["steps"]):
                        result = session.move(range(len(moved)), moved, **scenario.options)
                    return Outcome(result)
            if scenario.client["call"] == "move":
                with warnings.catch_warnings(record=True) as shown:
                    result = client.move(mesh, to=moved, **scenario.options)[0]
                return Outcome(result, message="".join(str(warning.message) for warning in shown))
            return Outcome(client.smooth(mesh, **scenario.options)[0])
    except ms.Error as error:
        assert mesh[0].tobytes() == scenario.points.tobytes()
        return _of_error(error)


def asyncio_python(scenario: Scenario, address: str, _: pathlib.Path) -> Outcome:
    """`ms.AsyncClient`."""
    mesh = (scenario.points.copy(), {"tetra": TETRA})

    async def run() -> Points:
        async with ms.AsyncClient(address, token_file=scenario.token_file) as client:
            if scenario.client["call"] == "attach":
                job = await client.attach(scenario.client["job"], mesh, **scenario.options)
                return (await job)[0]
            if scenario.client["call"] == "session":
                async with client.session(mesh) as session:
                    for _step in range(scenario.client["steps"]):
                        result = await session.smooth(scenario.points, **scenario.options)
                    return result
            moved = expected_motion(scenario.points)
            if scenario.client["call"] == "motion":
                async with client.session(mesh) as session:
                    for _step in range(scenario.client["steps"]):
                        result = await session.move(range(len(moved)), moved, **scenario.options)
                    return result
            if scenario.client["call"] == "move":
                return (await client.move(mesh, to=moved, **scenario.options))[0]
            return (await client.smooth(mesh, **scenario.options))[0]

    try:
        with warnings.catch_warnings(record=True) as shown:
            result = asyncio.run(run())
        return Outcome(result, message="".join(str(warning.message) for warning in shown))
    except ms.Error as error:
        assert mesh[0].tobytes() == scenario.points.tobytes()
        return _of_error(error)


def cpp(scenario: Scenario, address: str, folder: pathlib.Path) -> Outcome:
    """The C++ client, through the command line; its sessions through the examples."""
    if scenario.client["call"] in SESSIONS:
        return _of_program(_run(_program(SESSIONS[scenario.client["call"]]), address), None)
    output = folder / "out.vtk"
    mesh = folder / "in.vtk"
    _write_vtk(mesh, scenario.points)
    command = [_program("MESHSMOOTH_CLI"), scenario.client["call"]]
    command += [scenario.client["job"]] if scenario.client["call"] == "attach" else []
    command += [str(mesh), "--server", address, "-o", str(output), "--quiet"]
    if scenario.client["call"] == "move":
        _write_vtk(folder / "moved.vtk", expected_motion(scenario.points))
        command += ["--to", str(folder / "moved.vtk")]
    if scenario.token_file is not None:
        command += ["--token-file", str(scenario.token_file)]
    for name, value in scenario.options.items():
        command += [f"--{name.replace('_', '-')}", str(value)]
    ended = _run(*command)
    assert (ended.returncode in (0, INCOMPLETE)) == output.exists(), ended.stderr
    return _of_program(ended, output if output.exists() else None)


PLAYERS: dict[str, Callable[[Scenario, str, pathlib.Path], Outcome]] = {
    "python": python,
    "asyncio": asyncio_python,
    "cpp": cpp,
}


def _program(variable: str) -> str:
    path = os.environ.get(variable)
    if not path:
        pytest.skip(f"missing program: set {variable}")
    return path


def _run(*command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, timeout=HANGS_AFTER, check=False)


def _of_program(ended: subprocess.CompletedProcess[str], output: pathlib.Path | None) -> Outcome:
    if ended.returncode in (0, INCOMPLETE):
        result = None if output is None else _read_vtk(output)
        return Outcome(result, message=ended.stderr, kind=ended.returncode or "")
    # As the command line and the example print it.
    reason = re.search(r"\(([A-Z]+(?:_[A-Z]+)*)\)|^([A-Z_]+):", ended.stderr)
    found = (reason[1] or reason[2]) if reason else ""
    return Outcome(None, found, ended.stderr, ended.returncode)


def _write_vtk(path: pathlib.Path, points: Points) -> None:
    cells = np.insert(TETRA, 0, 4, axis=1).astype(">i4")
    with path.open("wb") as file:
        file.write(b"# vtk DataFile Version 3.0\nmesh\nBINARY\nDATASET UNSTRUCTURED_GRID\n")
        file.write(f"POINTS {len(points)} double\n".encode() + points.astype(">f8").tobytes())
        file.write(f"\nCELLS {len(cells)} {cells.size}\n".encode() + cells.tobytes())
        types = np.full(len(cells), 10, ">i4")
        file.write(f"\nCELL_TYPES {len(cells)}\n".encode() + types.tobytes() + b"\n")


def _read_vtk(path: pathlib.Path) -> Points:
    content = path.read_bytes()
    header = re.search(rb"\nPOINTS (\d+) double\n", content)
    assert header
    points = np.frombuffer(content, ">f8", 3 * int(header[1]), header.end())
    return points.reshape(-1, 3).astype(float)
