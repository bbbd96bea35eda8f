"""The rendered reference has every public name, and Sphinx no complaint."""

from __future__ import annotations

import html
import os
import pathlib
import re
import subprocess
import sys

import pytest

import meshsmooth as ms

ROOT = pathlib.Path(__file__).resolve().parents[3]


def test_every_public_name_is_in_the_reference(tmp_path: pathlib.Path) -> None:
    pytest.importorskip("sphinx", reason="missing package: sphinx")
    script = ROOT / "scripts" / "reference"
    environment = os.environ | {"MESHSMOOTH_PYTHON": sys.executable}
    done = subprocess.run(
        [script, "--python", tmp_path], capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    page = (tmp_path / "python" / "index.html").read_text(encoding="utf-8")
    described = set(re.findall(r'id="meshsmooth\.([\w.]+)"', page))
    missing = [name for name in ms.__all__ if name != "gmsh" and name not in described]
    assert not missing
    assert {"Client.smooth_many", "AsyncClient.map", "Session.move", "gmsh.move"} <= described
    assert {"torch.move", "torch.predict", "jax.move", "jax.predict"} <= described
    text = html.unescape(re.sub(r"<[^>]+>", "", page))
    for name in ms.JobOptions.__annotations__:  # as a parameter with its meaning
        assert re.search(rf"{name} \(", text), name
