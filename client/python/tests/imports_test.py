"""The modules of the package form no circle and can be imported in any order."""

from __future__ import annotations

import ast
import graphlib
import pathlib
import subprocess
import sys

import meshsmooth as ms

FOLDER = pathlib.Path(ms.__file__).parent
NAMES = {path.stem for path in FOLDER.glob("*.py")} - {"__init__"}


def imported_by(name: str) -> set[str]:
    """The modules of the package that one imports anywhere, in functions and for types too."""
    found = set()
    for node in ast.walk(ast.parse((FOLDER / f"{name}.py").read_text())):
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            found |= {node.module} if node.module else {alias.name for alias in node.names}
    return found & NAMES


def test_imports_form_no_circle() -> None:
    graph = {name: imported_by(name) for name in NAMES}
    assert graph["_client"]
    graphlib.TopologicalSorter(graph).prepare()


# The package itself, which imports all of them in one order, is not run.
ALONE = """
import importlib, sys, types
for name in sys.argv[2:]:
    for loaded in [loaded for loaded in sys.modules if loaded.startswith("meshsmooth")]:
        if ".v1" not in loaded:  # protobuf has each message once
            del sys.modules[loaded]
    sys.modules["meshsmooth"] = types.ModuleType("meshsmooth")
    sys.modules["meshsmooth"].__path__ = [sys.argv[1]]
    importlib.import_module("meshsmooth." + name)
    print(name)
"""


def test_each_module_can_be_imported_first() -> None:
    # Without a program, and what needs PyVista, JAX and PyTorch.
    names = sorted(NAMES - {"__main__", "_pyvista", "jax", "torch"})
    command = [sys.executable, "-c", ALONE, str(FOLDER), *names]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout.split() == names, done.stderr
