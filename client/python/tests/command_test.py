"""`python -m meshsmooth` on files of PyVista, meshio and gmsh."""

from __future__ import annotations

import json
import pathlib
from typing import Any

import numpy as np
import pytest
from conftest import cube

import meshsmooth as ms
from meshsmooth import __main__ as command
from meshsmooth._job_options import MOVE_OPTIONS, OPTIONS

pytestmark = pytest.mark.usefixtures("server")


def peer(name: str) -> Any:
    return pytest.importorskip(name, reason=f"missing package: {name}")


@pytest.fixture(params=["part.vtu", "part.vtk", "part.msh", "part.inp"])
def part(request: pytest.FixtureRequest, tmp_path: pathlib.Path) -> pathlib.Path:
    for name in ("meshio", "pyvista", "gmsh"):
        peer(name)
    points, cells = cube()
    path = tmp_path / request.param
    extra = {"file_format": "gmsh22"} if path.suffix == ".msh" else {}
    peer("meshio").Mesh(points, cells).write(path, **extra)
    return path


def test_smooths_measures_and_compares(
    part: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    better = part.with_name("better" + part.suffix)
    summary = part.with_name("summary.json")
    given = ["--goal", "worst", "--iterations", "30", "--json", str(summary)]
    assert command.main(["smooth", str(part), "-o", str(better), *given]) == 0
    assert "no element is inverted" in capsys.readouterr().out
    assert json.loads(summary.read_text())["options"]["max_iteration_count"] == 30
    assert command.main(["quality", str(better)]) == 0
    assert "mean ratio" in capsys.readouterr().out
    assert command.main(["compare", str(part), str(better)]) == 0
    told = capsys.readouterr().out
    assert "of 216 nodes moved" in told
    assert "nothing else differs" in told
    points, cells = cube()
    expected = ms.smooth((points, cells), goal="worst", iterations=30)[0]
    written = np.asarray(peer("meshio").read(better).points)
    assert np.allclose(np.sort(written, axis=0), np.sort(expected, axis=0), atol=1e-6)


def test_moves_to_another_file(part: pathlib.Path, capsys: pytest.CaptureFixture[str]) -> None:
    meshio = peer("meshio")
    points, cells = ms.smooth(cube())
    valid, target = part.with_name("valid.vtu"), part.with_name("target.vtu")
    meshio.Mesh(points, cells).write(valid)
    meshio.Mesh(points * [1, 1, 1.5], cells).write(target)
    moved = part.with_name("moved.vtu")
    assert command.main(["move", str(valid), "--to", str(target), "-o", str(moved)]) == 0
    assert "reached 100 %" in capsys.readouterr().out
    assert np.isclose(meshio.read(moved).points[:, 2].max(), 1.5)
    meshio.Mesh(points * [1, 1, -1], cells).write(target)
    assert command.main(["move", str(valid), "--to", str(target), "-o", str(moved)]) == 6


def test_exit_codes(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    meshio = peer("meshio")
    points, cells = cube()
    part, out = str(tmp_path / "part.vtu"), str(tmp_path / "out.vtu")
    meshio.Mesh(points, cells).write(part)
    assert command.main(["smooth", "none.vtu", "-o", out]) == 1
    assert "none.vtu: there is no such file" in capsys.readouterr().err
    assert command.main(["smooth", part, "-o", out, "--stay", "-1"]) == 2
    points[3] = np.nan
    meshio.Mesh(points, cells).write(part)
    assert command.main(["smooth", part, "-o", out]) == 3
    assert "node 3" in capsys.readouterr().err
    monkeypatch.setenv("MESHSMOOTH_SERVER", "unix:/nowhere/socket")
    assert command.main(["quality", part]) == 4
    assert not pathlib.Path(out).exists()
    with pytest.raises(SystemExit):
        command.main(["smooth", part, "-o", out, "--goal", "best"])
    assert "invalid choice" in capsys.readouterr().err


@pytest.mark.parametrize(("name", "options"), [("smooth", OPTIONS), ("move", MOVE_OPTIONS)])
def test_help_lists_every_option(
    name: str, options: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        command.main([name, "--help"])
    told = capsys.readouterr().out
    for option in options:
        if option not in command._ELSEWHERE:
            assert f"--{option.replace('_', '-')}" in told
