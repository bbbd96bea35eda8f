"""What the packages say of themselves."""

from __future__ import annotations

import pathlib
import re
import subprocess

import pytest

tomllib = pytest.importorskip("tomllib", reason="missing: Python 3.11 or later")

PACKAGE = pathlib.Path(__file__).resolve().parents[1]
ROOT = PACKAGE.parents[1]
CLIENT = tomllib.loads((PACKAGE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SERVER = tomllib.loads((PACKAGE / "server/pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_licence_is_inside() -> None:
    assert CLIENT["license-files"] == ["LICENSE"]
    assert (PACKAGE / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


def test_one_range_of_python_versions() -> None:
    assert CLIENT["requires-python"] == SERVER["requires-python"] == ">=3.10"
    named = [c.rpartition(" :: ")[2] for c in CLIENT["classifiers"] if ":: Python :: 3." in c]
    assert named[0] == "3.10"
    guide = (ROOT / "docs/python.md").read_text(encoding="utf-8")
    assert "for Python 3.10 and later" in guide


def test_the_extra_is_of_this_version_and_only_where_there_is_a_wheel() -> None:
    version = re.search(
        r"project\(meshsmooth VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text()
    )
    assert version
    marker = "sys_platform == 'linux' and platform_machine == 'x86_64'"
    expected = f"meshsmooth-server=={version[1]}; {marker}"
    assert CLIENT["optional-dependencies"]["server"] == [expected]


def test_a_server_without_cuda_does_not_speak_of_it(tmp_path: pathlib.Path) -> None:
    """By the function of scripts/wheels, on copies."""
    text = (ROOT / "scripts/wheels").read_text(encoding="utf-8")
    function = re.search(r"^without_cuda\(\) \{\n.*?^\}\n", text, re.MULTILINE | re.DOTALL)
    assert function
    for name in ("pyproject.toml", "README.md"):
        (tmp_path / name).write_bytes((PACKAGE / "server" / name).read_bytes())
    script = f'set -euo pipefail\ndie() {{ echo "$*" >&2; exit 1; }}\n{function[0]}without_cuda\n'
    subprocess.run(
        ["bash", "-c", script], check=True, env={"stage": str(tmp_path), "PATH": "/bin:/usr/bin"}
    )
    without = tomllib.loads((tmp_path / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert "CUDA" not in str(without) + (tmp_path / "README.md").read_text(encoding="utf-8")
    assert "NVIDIA" not in str(without)
    assert without["license"].startswith("Apache-2.0 AND BSD-3-Clause")
