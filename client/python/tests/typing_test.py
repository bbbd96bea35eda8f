"""What type checkers see of the package."""

from __future__ import annotations

import json
import pathlib
import re
import subprocess
import sys

import pytest

PACKAGE = pathlib.Path(__file__).resolve().parents[1]

CODE = """
from typing import Any
import numpy as np
from numpy.typing import NDArray
import meshsmooth as ms

class Grid: ...

grid = Grid()
points: NDArray[np.float64] = np.zeros((4, 3))
client = ms.Client()
reveal_type(ms.smooth(grid))
reveal_type(ms.smooth(grid, full=True).mesh)
reveal_type(ms.smooth((points, {}), out=points))
reveal_type(client.submit(grid).result())
reveal_type([*client.map([grid])][0])
reveal_type(ms.move(grid, displacement="u", prescribed="wall"))
def either(full: bool) -> Grid | ms.SmoothResult[Grid]:
    return ms.smooth(grid, full=full)
print(ms.smooth(grid, full=True).summary.quality_after.metric("mean_ratio").min)
print(ms.__version__, ms.LocalServer().address)
for nodes in ([0, 3], np.array([True, False]), "wall", ["wall", "tip"], range(3), None):
    ms.smooth(grid, fixed=nodes)
ms.smooth(grid, method=ms.Optimize(goal="worst"), boundary="slide", movement_limit="1%")
"""
WRONG = """
import meshsmooth as ms
ms.smooth(object(), boundary="loose")
ms.smooth(object(), iteratons=3)
ms.Optimize(goal="best")
ms.move(object(), displacment=[])
ms.smoth(object())
ms.Sumary
ms.smooth(object(), fixed=3.5)
ms.smooth(object(), iterations="many")
"""
WRONG_LINES = range(3, 3 + len(WRONG.strip().splitlines()) - 1)


def check(code: str, folder: pathlib.Path) -> str:
    pytest.importorskip("mypy", reason="missing package: mypy")
    file = folder / "code.py"
    file.write_text(code)
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(folder / "cache")]
    done = subprocess.run(
        [*command, "--follow-imports=silent", str(file)],
        capture_output=True,
        text=True,
        check=False,
        cwd=PACKAGE,  # for the settings in pyproject.toml
        env={"MYPYPATH": str(PACKAGE / "src"), "PATH": ""},
    )
    return done.stdout


def test_results_have_the_type_of_the_mesh(tmp_path: pathlib.Path) -> None:
    output = check(CODE, tmp_path)
    assert "error" not in output, output
    types = re.findall(r'Revealed type is "([^"]*)"', output)
    assert [name.rpartition(".")[2] for name in types][:2] == ["Grid", "Grid"]
    assert types[2].startswith("numpy.ndarray")
    assert [name.rpartition(".")[2] for name in types][3:] == ["Grid", "Grid", "Grid"]


def test_wrong_options_are_errors(tmp_path: pathlib.Path) -> None:
    output = check(WRONG, tmp_path)
    for line in WRONG_LINES:
        assert f"code.py:{line}: error" in output, (line, output)


def test_pyright_agrees(tmp_path: pathlib.Path) -> None:
    pytest.importorskip("pyright", reason="missing package: pyright")
    for name, code in (("right.py", CODE), ("wrong.py", WRONG)):
        (tmp_path / name).write_text(code)
    (tmp_path / "pyrightconfig.json").write_text(
        json.dumps({"extraPaths": [str(PACKAGE / "src")], "typeCheckingMode": "basic"})
    )
    done = subprocess.run(
        [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    if not done.stdout.startswith("{"):
        pytest.skip("missing tool: pyright, whose package could not fetch it")
    found: dict[str, set[int]] = {"right.py": set(), "wrong.py": set()}
    for entry in json.loads(done.stdout)["generalDiagnostics"]:
        if entry["severity"] == "error":
            name = pathlib.Path(entry["file"]).name
            found[name].add(entry["range"]["start"]["line"] + 1)
    assert found == {"right.py": set(), "wrong.py": set(WRONG_LINES)}
