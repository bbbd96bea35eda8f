"""Signatures, docstrings and completion list every option."""

from __future__ import annotations

import importlib
import inspect
import sys
import types
from typing import Any

import pytest

import meshsmooth as ms
from meshsmooth import _job_options

OPTIONS = set(ms.JobOptions.__annotations__)
MOVE_OPTIONS = set(ms.MoveOptions.__annotations__) | OPTIONS
STEP_OPTIONS = OPTIONS - set(_job_options.TOPOLOGY_OPTIONS)

ENTRIES: list[tuple[Any, set[str]]] = [
    *(
        (f, OPTIONS)
        for f in (ms.smooth, ms.smooth_many, ms.quality, ms.gmsh.smooth, ms.gmsh.quality)
    ),
    *((f, MOVE_OPTIONS) for f in (ms.move, ms.gmsh.move)),
    *(
        (getattr(kind, name), MOVE_OPTIONS if name == "move" else OPTIONS)
        for kind in (ms.Client, ms.AsyncClient)
        for name in ("smooth", "move", "quality", "submit", "map", "smooth_many", "session")
    ),
    *(
        (getattr(kind, name), STEP_OPTIONS)
        for kind in (ms.Session, ms.AsyncSession)
        for name in ("smooth", "move")
    ),
]


@pytest.mark.parametrize(("function", "options"), ENTRIES)
def test_every_option_is_listed(function: Any, options: set[str]) -> None:
    parameters = inspect.signature(function).parameters
    assert options <= set(parameters)
    assert not any(p.kind is p.VAR_KEYWORD for p in parameters.values())
    listed = inspect.getdoc(function) or ""
    own = listed[listed.index("Options:") :]
    for name in options:
        assert f"\n    {name} (" in own, name


def test_the_accessor_lists_them_too() -> None:
    pytest.importorskip("pyvista", reason="missing package: pyvista")
    accessor = importlib.import_module("meshsmooth._pyvista").MeshsmoothAccessor
    for name, options in (
        ("smooth", OPTIONS),
        ("move", MOVE_OPTIONS),
        ("quality", OPTIONS),
        ("session", OPTIONS),
    ):
        test_every_option_is_listed(getattr(accessor, name), options)


def test_completion_lists_them() -> None:
    jedi: Any = pytest.importorskip("jedi", reason="missing package: jedi")
    client = ms.Client.__new__(ms.Client)

    def completed(code: str) -> set[str]:
        names = {"ms": ms, "grid": object(), "client": client}
        return {found.name.rstrip("=") for found in jedi.Interpreter(code, [names]).complete()}

    assert completed("ms.smooth(grid, ") >= OPTIONS
    assert completed("ms.move(grid, ") >= MOVE_OPTIONS
    assert completed("client.smooth(grid, ") >= OPTIONS
    assert completed("ms.gmsh.smooth(") >= OPTIONS
    assert completed("ms.") >= {*ms.__all__, "__version__"}


def test_names_are_the_packages() -> None:
    assert {*ms.__all__, "__version__"} <= set(dir(ms))
    assert not {"TYPE_CHECKING", "Any"} & set(dir(ms))
    for name in ms.__all__:
        found = getattr(ms, name)
        if not isinstance(found, types.ModuleType):
            assert found.__module__ == "meshsmooth", name
            assert sys.flags.optimize > 1 or found.__doc__


def test_defaults_are_the_servers(client: ms.Client) -> None:
    theirs = client.info().raw["default_options"]
    for name, (_, option) in _job_options.OPTIONS.items():
        if option.field not in theirs:
            continue
        value = theirs[option.field]
        if isinstance(value, str):  # an enumerator
            value = repr(value.rpartition("_")[2].lower())
        assert option.default, name
        assert eval(option.default) == (eval(value) if isinstance(value, str) else value), name
    for name in ("goal", "target", "stay"):
        value = theirs["optimize"][name]
        default = eval(_job_options.OPTIONS[name][1].default)
        assert value == default or str(value).endswith("_" + str(default).upper())
