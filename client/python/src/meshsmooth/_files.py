"""Mesh files, by whichever of PyVista, gmsh and meshio reads them."""

from __future__ import annotations

import importlib
import importlib.util
import pathlib
from collections.abc import Callable
from typing import Any, NamedTuple

_VTK = {".vtu", ".vtk", ".vtp", ".vti", ".vts", ".vtr", ".vtm", ".ply", ".stl", ".obj"}
_GMSH = {".msh", ".geo", ".step", ".stp", ".brep", ".iges", ".igs"}


class MeshFile(NamedTuple):
    """A mesh that was read, and how one of the same kind is written."""

    mesh: Any
    save: Callable[[Any, str], None]


def read_file(path: str) -> MeshFile:
    """Reads a mesh: VTK's formats by PyVista, gmsh's by gmsh, others by meshio.

    Raises:
        FileNotFoundError: there is no such file.
        ModuleNotFoundError: none of the packages that read it is installed.
        ValueError: it cannot be read.
    """
    if not pathlib.Path(path).is_file():
        raise FileNotFoundError(f"{path}: there is no such file")
    suffix = pathlib.Path(path).suffix.lower()
    ways = [("meshio", _by_meshio), ("pyvista", _by_pyvista)]
    if suffix in _VTK:
        ways.reverse()
    elif suffix in _GMSH:
        ways.insert(0, ("gmsh", _by_gmsh))
    installed = [way for name, way in ways if importlib.util.find_spec(name) is not None]
    if not installed:
        names = " or ".join(name for name, _ in ways)
        raise ModuleNotFoundError(f"{path} is read by {names}; run: pip install {ways[0][0]}")
    try:
        return installed[0](path)
    except (Exception, SystemExit) as error:  # meshio exits where it does not know a format
        raise ValueError(f"{path}: cannot be read: {error}") from error


def _by_pyvista(path: str) -> MeshFile:
    pyvista: Any = importlib.import_module("pyvista")

    def save(mesh: Any, target: str) -> None:
        if pathlib.Path(target).suffix.lower() in _VTK:
            mesh.save(target)
        else:
            pyvista.save_meshio(target, mesh)

    return MeshFile(pyvista.read(path), save)


def _by_meshio(path: str) -> MeshFile:
    meshio: Any = importlib.import_module("meshio")
    return MeshFile(meshio.read(path), lambda mesh, target: mesh.write(target))


def _by_gmsh(path: str) -> MeshFile:
    from .gmsh import read, write

    gmsh: Any = importlib.import_module("gmsh")
    if not gmsh.isInitialized():
        gmsh.initialize(["gmsh", "-v", "2"])
    gmsh.open(path)
    model = gmsh.model.getCurrent()
    before = read()

    def save(mesh: Any, target: str) -> None:
        gmsh.model.setCurrent(model)
        write(before, mesh.points)
        gmsh.write(target)

    return MeshFile(before, save)
