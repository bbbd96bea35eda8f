"""The types of cells: names, numbers, nodes, and what is done about those that are not taken."""

from __future__ import annotations

import difflib
import operator
from typing import Any, NamedTuple

import numpy as np


class CellType(NamedTuple):
    """A type of cell that may be in a mesh."""

    name: str  # meshio's
    vtk: int
    dimension: int
    node_count: int  # 0: any
    element: int  # of meshsmooth.v1.ElementType; 0: not an element


TYPES = (
    CellType("vertex", 1, 0, 1, 0),
    CellType("poly_vertex", 2, 0, 0, 0),
    CellType("line", 3, 1, 2, 0),
    CellType("poly_line", 4, 1, 0, 0),
    CellType("triangle", 5, 2, 3, 1),
    CellType("quad", 9, 2, 4, 2),
    CellType("tetra", 10, 3, 4, 3),
    CellType("pyramid", 14, 3, 5, 4),
    CellType("wedge", 13, 3, 6, 5),
    CellType("hexahedron", 12, 3, 8, 6),
    CellType("line3", 21, 1, 3, 0),
    CellType("triangle6", 22, 2, 6, 7),
    CellType("quad8", 23, 2, 8, 8),
    CellType("quad9", 28, 2, 9, 9),
    CellType("tetra10", 24, 3, 10, 10),
    CellType("pyramid13", 27, 3, 13, 11),
    CellType("wedge15", 26, 3, 15, 12),
    CellType("wedge18", 32, 3, 18, 13),
    CellType("hexahedron20", 25, 3, 20, 14),
    CellType("hexahedron27", 29, 3, 27, 15),
)
BY_NAME = {kind.name: kind for kind in TYPES}
BY_NAME |= {
    "point": BY_NAME["vertex"],
    "edge": BY_NAME["line"],
    "tri": BY_NAME["triangle"],
    "quadrilateral": BY_NAME["quad"],
    "tet": BY_NAME["tetra"],
    "tetrahedron": BY_NAME["tetra"],
    "prism": BY_NAME["wedge"],
    "hex": BY_NAME["hexahedron"],
}
BY_VTK = {kind.vtk: kind for kind in TYPES}
DIMENSIONS = {kind.name: kind.dimension for kind in TYPES}
ELEMENT_TO_VTK = {kind.element: kind.vtk for kind in TYPES if kind.element}
VOLUMES = {kind.element: kind.dimension == 3 for kind in TYPES if kind.element}
POLYGON = 7
SIZES = np.full(256, -1, np.int64)  # nodes of a VTK type; 0: any, -1: not known
for _kind in TYPES:
    SIZES[_kind.vtk] = _kind.node_count
SIZES[POLYGON] = 0
SIZES[8], SIZES[11] = 4, 8  # pixel and voxel

# VTK lets the normal of a wedge's first triangle point out of the wedge, gmsh into it; the nodes in
# the middle of edges and faces follow in VTK's order.
WEDGE_OF_GMSH = [0, 2, 1, 3, 5, 4]
_TURNED = [*WEDGE_OF_GMSH, 8, 7, 6, 11, 10, 9, 12, 14, 13, 17, 16, 15]
TURNED_WEDGES = {"wedge": WEDGE_OF_GMSH, "wedge15": _TURNED[:15], "wedge18": _TURNED}

# Cells of VTK's images count their nodes by coordinates: those of quads and hexahedra in another
# order.
UNFOLDED = {8: (9, [0, 1, 3, 2]), 11: (12, [0, 1, 3, 2, 4, 5, 7, 6])}

# What is not taken, by VTK's number.
_OTHER_TYPES = {
    6: "triangle strip",
    7: "polygon",
    15: "pentagonal prism",
    16: "hexagonal prism",
    33: "biquadratic quadratic hexahedron",
    34: "biquadratic triangle",
    41: "convex point set",
    42: "polyhedron",
}
_HINTS = {
    6: "make triangles of it (PyVista: mesh.triangulate())",
    7: "make triangles of it (PyVista: mesh.triangulate())",
    41: "make tetrahedra of it (PyVista: mesh.triangulate())",
    42: "make tetrahedra of it (PyVista: mesh.triangulate())",
}


def vtk_type_text(vtk: int, node_count: int | None = None) -> str:
    """Returns a type of VTK in words, for errors."""
    name = _OTHER_TYPES.get(vtk)
    if name is None:
        return f"VTK cell type {vtk}"
    nodes = "" if node_count is None else f" of {node_count} nodes"
    return f"{name}{nodes} (VTK cell type {vtk})"


def vtk_type_hint(vtk: int) -> str:
    """Returns what to do about a type of VTK that is not taken."""
    return _HINTS.get(vtk, "")


def find_type(name: Any) -> CellType | None:
    """Returns the type of a name or of VTK's number; None: it is not known."""
    return BY_NAME.get(name) if isinstance(name, str) else BY_VTK.get(operator.index(name))


def meant_by(name: str) -> str:
    """Returns a question after the type that an unknown name seems to mean, or ""."""
    near = difflib.get_close_matches(name.lower(), BY_NAME, 1)
    if name.isdigit() and int(name) in BY_VTK:
        return f"did you mean the number {name}, {BY_VTK[int(name)].name!r}?"
    if near and _digits(near[0]) == _digits(name):
        return f"did you mean {BY_NAME[near[0]].name!r}?"
    return ""


def _digits(name: str) -> str:
    return "".join(filter(str.isdigit, name))
