"""The plugin for ParaView, in ParaView's own Python.

MESHSMOOTH_PVPYTHON  the program pvpython; by default the one in the path
"""

from __future__ import annotations

import inspect
import json
import os
import pathlib
import re
import shutil
import subprocess
from typing import Any

import numpy as np
import pytest
from conftest import cube, run_cli
from meshes import Case, read_vtk_points, surface_case
from recipes_test import environment

HERE = pathlib.Path(__file__).resolve().parent
PLUGIN = HERE.parent / "paraview" / "meshsmooth_plugin.py"
PAGE = HERE.parents[2] / "docs" / "paraview.md"
HANGS_AFTER = 400  # seconds

if not os.environ.get("MESHSMOOTH_WITH_PEERS"):
    pytest.skip(
        "foreign programs are tested by scripts/test --with-peers only", allow_module_level=True
    )


def tetra_case(count: int, break_one: bool = False) -> Case:
    points, cells = cube(count)
    rows = [("tetra", tuple(map(int, row))) for row in cells["tetra"]]
    if break_one:
        rows[3] = ("tetra", (0, 0, 1, 2))
    return Case(points, rows)


def write(path: pathlib.Path, case: Case, **arrays: Any) -> str:
    """Writes a VTK file with point arrays of 1 or 3 numbers, and `regions` of the cells."""
    case.write_vtk(path)
    regions = arrays.pop("regions", None)
    text = f"POINT_DATA {len(case.points)}\n"
    for name, values in arrays.items():
        kind = "VECTORS {} double" if values.ndim == 2 else "SCALARS {} int 1\nLOOKUP_TABLE default"
        rows = np.atleast_2d(values.T).T.tolist()
        text += kind.format(name) + "\n" + "\n".join(" ".join(map(repr, r)) for r in rows) + "\n"
    if regions is not None:
        text += f"CELL_DATA {len(case.rows)}\nSCALARS regions int 1\nLOOKUP_TABLE default\n"
        text += "\n".join(map(str, regions.tolist())) + "\n"
    with path.open("a") as file:
        file.write(text)
    return str(path)


class Session:
    """Everything that ParaView is asked, in one start of it, and what came of it."""

    def __init__(self, folder: pathlib.Path, server: str) -> None:
        self.folder = folder
        case = tetra_case(8)
        x = case.points[:, 0]
        centres = np.array([case.points[list(row), 0].mean() for _, row in case.rows])
        displacement = np.stack([0.2 * np.sin(3 * x), 0.1 * x, 0.3 * x * x], axis=1)
        mesh = write(
            folder / "mesh.vtk",
            case,
            held=(np.arange(len(x)) % 3 == 0).astype(int),
            u=displacement,
            regions=(centres > 0.5).astype(int),
        )
        surface = write(folder / "surface.vtk", surface_case((9, 7), [1], 5, np.float64))
        large = write(folder / "large.vtk", tetra_case(32))
        broken = write(folder / "broken.vtk", tetra_case(5, break_one=True))
        smooth, move = "meshsmoothSmooth", "meshsmoothMove"
        chosen = {"Goal": "worst", "FixedNodes": "held", "Regions": "regions", "MovementLimit": 1.0}
        here = {"Server": server}
        self.steps: list[dict[str, Any]] = [
            {"name": "defaults", "filter": smooth, "input": mesh, "properties": here},
            {"name": "chosen", "filter": smooth, "input": mesh, "properties": here | chosen},
            {
                "name": "surface",
                "filter": smooth,
                "input": surface,
                "properties": here
                | {"Method": "taubin", "Boundary": "free", "Iterations": 5, "ElementQuality": 0},
            },
            {
                "name": "moved",
                "filter": move,
                "input": mesh,
                "properties": here | {"Displacement": "u"},
            },
            {
                "name": "cancelled",
                "filter": smooth,
                "input": large,
                "properties": here | {"Goal": "worst"},
                "cancel": True,
            },
            {
                "name": "distributed",
                "filter": smooth,
                "input": mesh,
                "properties": here,
                "piece": 1,
            },
            {"name": "broken", "filter": smooth, "input": broken, "properties": here},
            {
                "name": "nobody",
                "filter": smooth,
                "input": mesh,
                "properties": {"Server": f"unix:{folder}/nobody", "Timeout": 5.0},
            },
        ]
        (folder / "steps.json").write_text(json.dumps(self.steps))
        script = HERE / "paraview_session.py"
        ended = run_pvpython(folder, script, PLUGIN, folder / "steps.json", folder)
        assert ended.returncode == 0, ended.stderr
        self.found = json.loads((folder / "found.json").read_text())
        parts = re.split(r"^step (\w+)\n", ended.stderr, flags=re.MULTILINE)
        self.messages = dict(zip(parts[1::2], parts[2::2], strict=True))

    def points(self, name: str) -> Any:
        return np.load(self.folder / f"{name}.npy")

    def cli(self, command: str, *options: object) -> Any:
        target = self.folder / "cli.vtk"
        ended = run_cli(command, *options, "-o", target, "--quiet")
        assert ended.returncode == 0, ended.stderr
        return read_vtk_points(target)


def run_pvpython(folder: pathlib.Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    name = os.environ.get("MESHSMOOTH_PVPYTHON", "pvpython")
    if (program := shutil.which(name)) is None:
        pytest.skip(f"missing program: {name} (Debian: python3-paraview)")
    own = environment()
    if not hasattr(inspect, "getargspec"):
        # What the page advises for ParaView 5.11.
        lines = re.search(r"^```\n(import inspect\n.*?)^```", PAGE.read_text(), re.DOTALL | re.M)
        assert lines
        (folder / "usercustomize.py").write_text(lines[1])
        own["PYTHONPATH"] += f"{os.pathsep}{folder}"
    return subprocess.run(
        [program, *map(str, arguments)],
        cwd=folder,
        env=own,
        capture_output=True,
        text=True,
        timeout=HANGS_AFTER,
        check=False,
    )


@pytest.fixture(scope="module")
def session(server: str, tmp_path_factory: pytest.TempPathFactory) -> Session:
    return Session(tmp_path_factory.mktemp("paraview"), server)


def assert_same(one: Any, other: Any) -> None:
    assert one.dtype == other.dtype
    assert np.array_equal(one, other)


def test_defaults_are_the_command_lines(session: Session) -> None:
    assert_same(session.points("defaults"), session.cli("smooth", session.folder / "mesh.vtk"))
    found = session.found["defaults"]
    assert found["kind"] == "vtkUnstructuredGrid"
    assert {"mean_ratio", "scaled_jacobian"} <= set(found["cell_arrays"])
    assert found["summary"]["quality_after"]["inverted_element_count"] == 0


def test_properties_are_the_command_lines_options(session: Session) -> None:
    expected = session.cli(
        "smooth", session.folder / "mesh.vtk", "--goal", "worst", "--fixed-set", "held",
        "--regions", "regions", "--movement-limit", "1%",
    )  # fmt: skip
    assert_same(session.points("chosen"), expected)
    assert (session.points("chosen") != session.points("defaults")).any()


def test_surfaces(session: Session) -> None:
    expected = session.cli(
        "smooth", session.folder / "surface.vtk", "--method", "taubin", "--boundary", "free",
        "--iterations", "5",
    )  # fmt: skip
    assert_same(session.points("surface"), expected)
    assert "mean_ratio" not in session.found["surface"]["cell_arrays"]


def test_moves(session: Session) -> None:
    expected = session.cli("move", session.folder / "mesh.vtk", "--displacement", "u")
    assert_same(session.points("moved"), expected)
    assert session.found["moved"]["summary"]["motion"]["reached"] == 1


def test_abort_cancels_the_job(session: Session) -> None:
    found = session.found["cancelled"]
    assert found["events"]
    assert found["cells"] == 0
    assert "meshsmooth: cancelled" in session.messages["cancelled"]


def test_distributed_meshes_are_refused(session: Session) -> None:
    assert session.found["distributed"]["cells"] == 0
    assert "distributed over processes" in session.messages["distributed"]


def test_errors_name_what_is_wrong(session: Session) -> None:
    assert session.found["broken"]["cells"] == 0
    assert re.search(r"meshsmooth: .*element 3.*REPEATED_NODE", session.messages["broken"])
    assert session.found["nobody"]["cells"] == 0
    assert "nobody" in session.messages["nobody"]
    assert "meshsmooth: " in session.messages["nobody"]


def test_script_of_the_page(
    server: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MESHSMOOTH_SERVER", server)
    code = re.search(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.M)
    assert code
    (tmp_path / "script.py").write_text(code[1])
    shutil.copy(PLUGIN, tmp_path)
    write(tmp_path / "part.vtk", tetra_case(6))
    ended = run_pvpython(tmp_path, "script.py")
    assert ended.returncode == 0, ended.stderr
    assert b"scaled_jacobian" in (tmp_path / "better.vtu").read_bytes()
