"""The code of docs/python.md, and of the README, runs block after block in one program."""

from __future__ import annotations

import os
import pathlib
import re

import pytest

import meshsmooth as ms
from meshsmooth import _adapters

ROOT = pathlib.Path(__file__).resolve().parents[3]
GUIDE = ROOT / "docs" / "python.md"
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)


def run_blocks(page: pathlib.Path) -> int:
    """Runs the Python of a page; returns the number of its blocks."""
    text = page.read_text(encoding="utf-8")
    names: dict[str, object] = {"server_address": os.environ["MESHSMOOTH_SERVER"]}
    blocks = list(BLOCK.finditer(text))
    for block in blocks:
        line = text.count("\n", 0, block.start(1))
        exec(compile("\n" * line + block[1], str(page), "exec"), names)
    return len(blocks)


@pytest.mark.usefixtures("server")
def test_code_of_the_readme() -> None:
    assert run_blocks(ROOT / "README.md") >= 1


@pytest.mark.usefixtures("server")
def test_code_of_the_guide(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(_adapters, "_registered", [])
    assert run_blocks(GUIDE) >= 8
    assert "element 0 (tetrahedron): node 6 is out of range" in capsys.readouterr().out


def test_guide_names_every_option_and_error() -> None:
    text = GUIDE.read_text(encoding="utf-8")
    for name in ms.MoveOptions.__annotations__:
        assert f"`{name}`" in text, name
    for error in vars(ms).values():
        if isinstance(error, type) and issubclass(error, ms.Error) and error is not ms.Error:
            assert f"| `{error.__name__}` |" in text, error.__name__
