"""Reads meshes of other packages and makes meshes of the same kind with other positions.

Kinds are recognized by what they have, not by their class, so that no package is imported and forks
and successors of a package work too. An adapter shares all but the points between its argument and
its result, as VTK's filters do.
"""

from __future__ import annotations

import copy
import dataclasses
import importlib
import os
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._cell_types import DIMENSIONS, TURNED_WEDGES
from ._errors import InvalidMesh
from ._mesh import LazyArrays, Mesh, MeshData

Points = NDArray[Any]


class Adapter(NamedTuple):
    """How to read a kind of mesh and how to make another of it.

    Attributes:
        read: returns the data of a mesh.
        write: returns a mesh of the same kind with positions [nodes, 2 or 3].
        annotate: adds an array of one float32 per cell to a mesh that `write` made; None: the kind
            has no cell arrays.
    """

    read: Callable[[Any], MeshData]
    write: Callable[[Any, Points], Any]
    annotate: Callable[[Any, str, NDArray[np.float32]], None] | None = None


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
    """

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
        if len(mesh) == 3 and np.ndim(mesh[2]) == 2:
            return Adapter(_read_triple, lambda triple, points: (*triple[:2], points))
    if callable(getattr(mesh, "IsA", None)):
        return _vtk_adapter(mesh)
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
        "known are PyVista's and VTK's unstructured grids and surfaces, those of meshio, trimesh "
        "and scikit-fem, (points, cells) and (cells, types, points); meshsmooth.register_adapter "
        "adds others"
    )


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


# --- VTK and PyVista -----------------------------------------------------------------------------


def _numpy_support() -> Any:
    return importlib.import_module("vtkmodules.util.numpy_support")


def _vtk_adapter(mesh: Any) -> Adapter:
    if mesh.IsA("vtkUnstructuredGrid"):
        return Adapter(_read_grid, _write_vtk, _annotate_vtk)
    if mesh.IsA("vtkPolyData"):
        return Adapter(_read_polydata, _write_vtk, _annotate_vtk)
    raise TypeError(
        f"a {mesh.GetClassName()} has no elements of its own; make an unstructured grid of it "
        "(PyVista: mesh.cast_to_unstructured_grid())"
    )


def _vtk_data(mesh: Any, cells: Any) -> MeshData:
    to_numpy = _numpy_support().vtk_to_numpy
    if mesh.GetPoints() is None:
        raise InvalidMesh("the mesh has no nodes", reason="MESH_EMPTY")
    return MeshData(
        to_numpy(mesh.GetPoints().GetData()),
        cells,
        point_data=_vtk_arrays(mesh.GetPointData(), (1, 3)),
        cell_data=_vtk_arrays(mesh.GetCellData(), (1,)),
    )


def _vtk_arrays(attributes: Any, component_counts: tuple[int, ...]) -> LazyArrays:
    to_numpy = _numpy_support().vtk_to_numpy
    arrays = [attributes.GetArray(index) for index in range(attributes.GetNumberOfArrays())]
    by_name = {
        array.GetName(): array
        for array in arrays
        if array is not None
        and array.GetName()
        and array.GetNumberOfComponents() in component_counts
    }
    return LazyArrays(list(by_name), lambda name: to_numpy(by_name[name]))


def _read_grid(mesh: Any) -> MeshData:
    to_numpy = _numpy_support().vtk_to_numpy
    cells = mesh.GetCells()
    if mesh.GetNumberOfCells() == 0:
        return _vtk_data(mesh, [])
    types = np.asarray(to_numpy(_cell_types(mesh)), np.uint8)
    return _vtk_data(
        mesh,
        (to_numpy(cells.GetOffsetsArray()), to_numpy(cells.GetConnectivityArray()), types),
    )


def _cell_types(mesh: Any) -> Any:
    # Of VTK 9.4 and later; the other name is deprecated there.
    get = getattr(mesh, "GetCellTypes", None)
    if get is not None:
        try:
            if (types := get()) is not None and hasattr(types, "GetNumberOfTuples"):
                return types
        except TypeError:  # before, it filled its argument
            pass
    return mesh.GetCellTypesArray()


def _read_polydata(mesh: Any) -> MeshData:
    """Cells count as VTK counts them: vertices, lines, polygons."""
    to_numpy = _numpy_support().vtk_to_numpy
    if mesh.GetNumberOfStrips() > 0:
        raise InvalidMesh(
            "the surface has triangle strips; make triangles of them (PyVista: mesh.triangulate())",
            reason="ELEMENT_NOT_SUPPORTED",
        )
    types, offsets, connectivity = [], [np.zeros(1, np.int64)], []
    for single, many, cells in (
        (1, 2, mesh.GetVerts()),
        (3, 4, mesh.GetLines()),
        (7, 7, mesh.GetPolys()),
    ):
        if cells is None or cells.GetNumberOfCells() == 0:
            continue
        own = np.asarray(to_numpy(cells.GetOffsetsArray()), np.int64)
        plain = 1 if single == 1 else 2
        types.append(np.where(np.diff(own) == plain, single, many).astype(np.uint8))
        offsets.append(own[1:] + offsets[-1][-1])
        connectivity.append(to_numpy(cells.GetConnectivityArray()))
    if not types:
        return _vtk_data(mesh, [])
    joined = connectivity[0] if len(connectivity) == 1 else np.concatenate(connectivity)
    return _vtk_data(mesh, (np.concatenate(offsets), joined, np.concatenate(types)))


def _write_vtk(mesh: Any, points: Points) -> Any:
    core = importlib.import_module("vtkmodules.vtkCommonCore")
    if hasattr(mesh, "copy"):  # PyVista's: NewInstance would return VTK's own class
        result = mesh.copy(deep=False)
    else:
        result = mesh.NewInstance()
        result.ShallowCopy(mesh)
    # A vtkPoints of its own: the copy shares the input's.
    own = core.vtkPoints()
    own.SetData(_numpy_support().numpy_to_vtk(np.ascontiguousarray(points)))
    result.SetPoints(own)
    return result


def _annotate_vtk(mesh: Any, name: str, values: NDArray[np.float32]) -> None:
    array = _numpy_support().numpy_to_vtk(values, deep=True)
    array.SetName(name)
    mesh.GetCellData().AddArray(array)


# --- meshio and what has its attributes ----------------------------------------------------------


def _read_meshio(mesh: Any) -> MeshData:
    return MeshData(
        mesh.points,
        _meshio_cells(mesh),
        point_data=getattr(mesh, "point_data", None) or {},
        cell_data=_meshio_cell_data(mesh),
        node_sets=_meshio_sets(mesh),
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
    if hasattr(mesh, "cell_data"):
        result.cell_data = dict(mesh.cell_data)
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
