"""The code of every page runs as it is printed, and the guide has all options and errors."""

from __future__ import annotations

import pathlib
import re

import option_table
import pytest
from conftest import program

import meshsmooth as ms
from meshsmooth import _adapters

ROOT = pathlib.Path(__file__).resolve().parents[3]
GUIDE = ROOT / "docs" / "python.md"
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)


PAGES = sorted(
    path
    for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("client/**/README.md"))
    if BLOCK.search(path.read_text(encoding="utf-8"))
    and path.name != "paraview.md"  # for ParaView's own Python
)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_code_runs_as_printed(
    page: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Block after block in one program, that has no other names."""
    program("MESHSMOOTH_SERVER_BINARY")
    monkeypatch.setattr(_adapters, "_registered", [])
    monkeypatch.delenv("MESHSMOOTH_SERVER")
    text = page.read_text(encoding="utf-8")
    names: dict[str, object] = {"__name__": "__main__"}
    for block in BLOCK.finditer(text):
        line = text.count("\n", 0, block.start(1))
        exec(compile("\n" * line + block[1], str(page), "exec"), names)
    if page == GUIDE:
        assert "element 0 (tetrahedron): node 6 is out of range" in capsys.readouterr().out


def test_pages_with_code_are_known() -> None:
    names = {str(page.relative_to(ROOT)) for page in PAGES}
    assert {
        "README.md",
        "docs/python.md",
        "docs/python-server.md",
        "client/python/README.md",
    } <= names


def test_table_of_options_is_current() -> None:
    assert GUIDE.read_text(encoding="utf-8") == option_table.current(), "run tests/option_table.py"


def test_guide_names_every_option_and_error() -> None:
    text = GUIDE.read_text(encoding="utf-8")
    for name in ms.MoveOptions.__annotations__:
        assert f"`{name}`" in text, name
    for error in vars(ms).values():
        if isinstance(error, type) and issubclass(error, ms.Error) and error is not ms.Error:
            assert f"| `{error.__name__}` |" in text, error.__name__
