"""Runs every program of examples/python, and the notebook, against a real server."""

from __future__ import annotations

import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import meshsmooth

FOLDER = pathlib.Path(__file__).resolve().parents[3] / "examples" / "python"
OPENFOAM = FOLDER.parent / "openfoam"
RECIPES = sorted(FOLDER.glob("*.py"))
MOST_LINES = 40
HANGS_AFTER = 300  # seconds


def environment() -> dict[str, str]:
    """Where a program finds the package under test, installed or not."""
    package = pathlib.Path(meshsmooth.__file__).parents[1]
    found = [str(package), os.environ.get("PYTHONPATH", "")]
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, found))}


def run_recipe(recipe: pathlib.Path, folder: pathlib.Path) -> str:
    """What a program printed that ended well."""
    ended = subprocess.run(
        [sys.executable, recipe],
        cwd=folder,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=HANGS_AFTER,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def test_there_are_recipes() -> None:
    assert len(RECIPES) >= 8


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda path: path.stem)
def test_recipe(recipe: pathlib.Path, server: str, tmp_path: pathlib.Path) -> None:
    text = recipe.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= MOST_LINES
    needs = re.search(r"^Needs: (.*)$", text, re.MULTILINE)
    assert needs, "the docstring lists what the recipe needs"
    for module in needs[1].split(", "):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"missing tool: {module}")
    assert run_recipe(recipe, tmp_path).strip(), "a recipe prints what it has done"
    check_files(text, tmp_path)


def test_bar_in_torsion_becomes_round(server: str, tmp_path: pathlib.Path) -> None:
    printed = run_recipe(FOLDER / "torsion.py", tmp_path)
    values = [float(found) for found in re.findall(r"step \d: ([\d.]+)", printed)]
    assert values[0] < 0.13
    assert values == sorted(values)
    assert values[-1] > 0.995 / (2 * np.pi)  # the mesh's polygon is not quite round


def check_files(text: str, folder: pathlib.Path) -> None:
    """The meshes that a recipe says it writes have cells of the types that it says."""
    for name, types in re.findall(r"^Writes: (.*): (.*)$", text, re.MULTILINE):
        meshio: Any = pytest.importorskip("meshio", reason="missing tool: meshio")
        written = {block.type for block in meshio.read(folder / name).cells}
        assert set(types.split(", ")) <= written, name


def test_openfoam_case(server: str, tmp_path: pathlib.Path) -> None:
    if not os.environ.get("MESHSMOOTH_WITH_PEERS"):
        pytest.skip("foreign programs are tested by scripts/test --with-peers only")
    for program in ("blockMesh", "foamToVTK", "checkMesh"):
        if shutil.which(program) is None:
            pytest.skip(f"missing tool: {program}")
    if importlib.util.find_spec("meshio") is None:
        pytest.skip("missing tool: meshio")
    case = tmp_path / "case"
    shutil.copytree(OPENFOAM, case)

    def run(*command: str) -> str:
        ended = subprocess.run(
            command,
            cwd=case,
            env=environment() | {"WM_PROJECT_DIR": "/usr/share/openfoam"},
            capture_output=True,
            text=True,
            timeout=HANGS_AFTER,
            check=False,
        )
        assert ended.returncode == 0, ended.stdout + ended.stderr
        return ended.stdout

    run("blockMesh")
    run("foamToVTK", "-legacy", "-no-boundary")
    assert "reached 100 % of the motion" in run(sys.executable, "move.py")
    checked = run("checkMesh", "-latestTime")
    assert "Time = 1" in checked
    assert "Mesh OK." in checked
    volume = re.search(r"Total volume = (\d+\.\d+)", checked)
    assert volume
    assert float(volume[1]) < 1.9  # of 2, before the floor swelled


def test_notebook(server: str, tmp_path: pathlib.Path, monkeypatch: Any) -> None:
    for module in ("nbformat", "nbclient", "ipykernel"):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"missing tool: {module}")
    nbformat: Any = importlib.import_module("nbformat")
    nbclient: Any = importlib.import_module("nbclient")
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
    notebook = nbformat.read(FOLDER / "first-steps.ipynb", as_version=4)
    nbformat.validate(notebook)
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=HANGS_AFTER, resources=resources).execute()
    shown = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert any("<svg" in output.get("data", {}).get("text/html", "") for output in shown)
