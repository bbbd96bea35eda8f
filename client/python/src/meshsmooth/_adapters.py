"""Reads meshes of other packages and makes meshes of the same kind with other positions.

Kinds are recognized by what they have, not by their class, so that no package is imported and forks
and successors of a package work too. An adapter shares all but the points between its argument and
its result, as VTK's filters do.
"""

from __future__ import annotations

import copy
import dataclasses
import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._adapter import Adapter, Points
from ._arrays import LazyArrays
from ._cell_types import DIMENSIONS, TURNED_WEDGES
from ._errors import InvalidMesh
from ._mesh import Mesh, MeshData
from ._vtk import vtk_adapter

_registered: list[tuple[type, Adapter]] = []


def register_adapter(
    kind: type,
    read: Callable[[Any], MeshData | tuple[Any, Any]],
    write: Callable[[Any, Points], Any],
) -> None:
    """Makes `smooth` and its like take meshes of a class and its subclasses.

    Args:
        kind: the class. An adapter registered later comes first.
        read: returns `(points, cells)` in any layout of docs/python.md, or a `MeshData`.
        write: gets the mesh and positions of the shape and type that `read` returned; returns a
            mesh of the same kind, without changing the one that it got.

    Raises:
        TypeError: `kind` is not a class, or another argument not a function.
    """
    if not isinstance(kind, type):
        raise TypeError(f"kind must be a class, it is {kind!r}")
    for name, function in (("read", read), ("write", write)):
        if not callable(function):
            raise TypeError(f"{name} must be a function, it is {function!r}")

    def read_data(mesh: Any) -> MeshData:
        data = read(mesh)
        return data if isinstance(data, MeshData) else MeshData(*data)

    _registered.insert(0, (kind, Adapter(read_data, write)))


def find_adapter(mesh: Any) -> Adapter:
    """Returns the adapter of a mesh.

    Raises:
        TypeError: nothing is known of this kind of mesh.
    """
    for kind, adapter in _registered:
        if isinstance(mesh, kind):
            return adapter
    if isinstance(mesh, MeshData):
        return Adapter(lambda data: data, lambda data, p: dataclasses.replace(data, points=p))
    if isinstance(mesh, tuple):
        if len(mesh) == 2:
            return Adapter(_read_pair, lambda pair, points: (points, pair[1]))
        if len(mesh) == 3 and _is_matrix(mesh[2]):
            return Adapter(_read_triple, lambda triple, points: (*triple[:2], points))
    if callable(getattr(mesh, "IsA", None)):
        return vtk_adapter(mesh)
    for names, adapter in _BY_ATTRIBUTES:
        if all(hasattr(mesh, name) for name in names):
            return adapter
    if isinstance(mesh, str | os.PathLike):
        raise TypeError(
            f"{os.fspath(mesh)!r} is a path; read the mesh first, as by pyvista.read(path), or "
            "run: python -m meshsmooth smooth"
        )
    raise TypeError(
        f"meshes of the type {type(mesh).__module__}.{type(mesh).__qualname__} are not known; "
        "known are PyVista's and VTK's grids, images, surfaces and multi-blocks, those of meshio, "
        "trimesh and scikit-fem, (points, cells) and (cells, types, points); "
        "meshsmooth.register_adapter adds others"
    )


def _is_matrix(given: Any) -> bool:
    try:
        return np.ndim(given) == 2
    except ValueError:  # rows of different lengths
        return False


def is_mesh(given: Any) -> bool:
    """Returns whether there is an adapter for it; arrays of positions have none."""
    try:
        find_adapter(given)
    except TypeError:
        return False
    return True


def _read_pair(pair: tuple[Any, Any]) -> MeshData:
    return MeshData(*pair)


def _read_triple(triple: tuple[Any, Any, Any]) -> MeshData:
    """What dolfinx.plot.vtk_mesh returns, and pyvista.UnstructuredGrid takes."""
    cells, types, points = triple
    return MeshData(points, (np.asarray(cells), np.asarray(types)))


def read_mesh(mesh: Any) -> Mesh:
    """Returns a mesh of any kind as it travels; errors as of `find_adapter`."""
    return Mesh(find_adapter(mesh).read(mesh))


# --- meshio and what has its attributes ----------------------------------------------------------


def _read_meshio(mesh: Any) -> MeshData:
    return MeshData(
        mesh.points,
        _meshio_cells(mesh),
        point_data=getattr(mesh, "point_data", None) or {},
        cell_data=_meshio_cell_data(mesh),
        node_sets=_meshio_sets(mesh),
        node_pairs=_meshio_pairs(mesh),
    )


def _meshio_cells(mesh: Any) -> Any:
    """meshio has gmsh's wedges whatever the file, and the other types as VTK has them."""

    def in_order_of_vtk(block: Any) -> Any:
        name = getattr(block, "type", "")
        order = TURNED_WEDGES.get(name)
        if order is None or np.shape(block.data)[-1] != len(order):
            return block
        return (name, np.asarray(block.data)[:, order])

    cells = mesh.cells
    return [in_order_of_vtk(block) for block in cells] if isinstance(cells, Sequence) else cells


def _meshio_pairs(mesh: Any) -> NDArray[np.int64] | None:
    """`$Periodic` of gmsh, by points, curves and surfaces."""
    links = getattr(mesh, "gmsh_periodic", None)
    return np.concatenate([link[-1] for link in links]).astype(np.int64) if links else None


def _meshio_cell_data(mesh: Any) -> LazyArrays:
    cell_data = getattr(mesh, "cell_data", None) or {}
    return LazyArrays(list(cell_data), lambda name: np.concatenate(list(cell_data[name])))


def _meshio_sets(mesh: Any) -> LazyArrays:
    point_sets = getattr(mesh, "point_sets", None) or {}
    cell_sets = getattr(mesh, "cell_sets", None) or {}
    groups = _physical_groups(mesh)

    def nodes(name: str) -> NDArray[Any]:
        found = []
        if name in point_sets:
            found.append(np.asarray(point_sets[name]))
        for block, chosen in zip(mesh.cells, cell_sets.get(name, ()), strict=False):
            if chosen is not None and len(chosen):
                found.append(np.asarray(block.data)[np.asarray(chosen, np.int64)].reshape(-1))
        for tag, dimension in groups.get(name, ()):
            for block, tags in zip(mesh.cells, mesh.cell_data["gmsh:physical"], strict=True):
                if DIMENSIONS.get(block.type) == dimension:
                    found.append(np.asarray(block.data)[np.asarray(tags) == tag].reshape(-1))
        return np.unique(np.concatenate(found)) if found else np.zeros(0, np.int64)

    return LazyArrays(list(dict.fromkeys([*point_sets, *cell_sets, *groups])), nodes)


def _physical_groups(mesh: Any) -> dict[str, list[tuple[int, int]]]:
    """Tag and dimension of each physical group; meshio keeps them in `field_data`."""
    if "gmsh:physical" not in (getattr(mesh, "cell_data", None) or {}):
        return {}
    groups: dict[str, list[tuple[int, int]]] = {}
    for name, value in (getattr(mesh, "field_data", None) or {}).items():
        if np.shape(value) == (2,):
            groups.setdefault(name, []).append((int(value[0]), int(value[1])))
    return groups


def _write_meshio(mesh: Any, points: Points) -> Any:
    result = copy.copy(mesh)
    result.points = points
    # Containers of its own, whose arrays are shared: what is added to the one is not in the other.
    for name in ("point_data", "cell_data", "point_sets", "cell_sets", "field_data"):
        container = getattr(mesh, name, None)
        if isinstance(container, dict):
            setattr(result, name, dict(container))
    if isinstance(mesh.cells, list):
        result.cells = list(mesh.cells)
    return result


def _annotate_meshio(mesh: Any, name: str, values: NDArray[np.float32]) -> None:
    ends = np.cumsum([len(block.data) for block in mesh.cells])
    mesh.cell_data[name] = np.split(values, ends[:-1])


# --- trimesh, scikit-fem -------------------------------------------------------------------------


def _read_trimesh(mesh: Any) -> MeshData:
    return MeshData(
        np.asarray(mesh.vertices),
        {"triangle": np.asarray(mesh.faces)},
        point_data=getattr(mesh, "vertex_attributes", {}),
        cell_data=getattr(mesh, "face_attributes", {}),
    )


def _write_trimesh(mesh: Any, points: Points) -> Any:
    result = mesh.copy()
    result.vertices = points
    return result


_SKFEM_CELLS = {
    "ElementTriP1": "triangle",
    "ElementQuad1": "quad",
    "ElementTetP1": "tetra",
    "ElementHex1": "hexahedron",
    "ElementWedge1": "wedge",
}
# scikit-fem's corner of each of VTK's.
_SKFEM_HEXAHEDRON = [0, 3, 6, 2, 1, 5, 7, 4]


def _read_skfem(mesh: Any) -> MeshData:
    element = mesh.elem
    name = getattr(element, "__name__", type(element).__name__)
    kind = _SKFEM_CELLS.get(name)
    if kind is None:
        raise InvalidMesh(
            f"a {type(mesh).__name__} has elements of the type {name}; only linear triangles, "
            "quads, tetrahedra, wedges and hexahedra can be smoothed",
            reason="ELEMENT_NOT_SUPPORTED",
        )
    corners = mesh.t[_SKFEM_HEXAHEDRON] if kind == "hexahedron" else mesh.t
    if kind in ("triangle", "tetra"):
        corners = _oriented(mesh.p, corners)
    boundaries = getattr(mesh, "boundaries", None) or {}

    def nodes(name: str) -> NDArray[Any]:
        return np.unique(mesh.facets[:, np.asarray(boundaries[name])])

    return MeshData(mesh.p.T, {kind: corners.T}, node_sets=LazyArrays(list(boundaries), nodes))


def _oriented(points: Points, simplices: NDArray[Any]) -> NDArray[Any]:
    """scikit-fem's simplices may turn either way; ours have a positive volume."""
    edges = points[:, simplices[1:]] - points[:, None, simplices[0]]
    turned = np.linalg.det(np.moveaxis(edges, -1, 0)) < 0
    if not turned.any():
        return simplices
    result = simplices.copy()
    result[:2, turned] = simplices[1::-1, turned]
    return result


def _write_skfem(mesh: Any, points: Points) -> Any:
    return dataclasses.replace(mesh, doflocs=np.ascontiguousarray(points.T))


_BY_ATTRIBUTES = (
    (("points", "cells"), Adapter(_read_meshio, _write_meshio, _annotate_meshio)),
    (("vertices", "faces"), Adapter(_read_trimesh, _write_trimesh)),
    (("p", "t", "elem"), Adapter(_read_skfem, _write_skfem)),
)
