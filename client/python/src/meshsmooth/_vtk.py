"""Meshes of VTK and PyVista."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._adapter import Adapter, Points
from ._arrays import LazyArrays
from ._errors import InvalidMesh
from ._mesh import MeshData
from ._multi_block import multi_block_adapter


def _numpy_support() -> Any:
    return importlib.import_module("vtkmodules.util.numpy_support")


def vtk_adapter(mesh: Any) -> Adapter:
    """Returns the adapter of a data object of VTK or PyVista.

    Raises:
        TypeError: it has no cells.
    """
    if mesh.IsA("vtkUnstructuredGrid"):
        return Adapter(_read_grid, _write_vtk, _annotate_vtk)
    if mesh.IsA("vtkPolyData"):
        return Adapter(_read_polydata, _write_vtk, _annotate_vtk)
    if mesh.IsA("vtkStructuredGrid"):
        return Adapter(lambda grid: _read_grid(_unstructured(grid)), _write_vtk, _annotate_vtk)
    if mesh.IsA("vtkImageData") or mesh.IsA("vtkRectilinearGrid"):
        # Its nodes cannot move: an unstructured grid with the same nodes and cells comes back.
        def write(image: Any, points: Points) -> Any:
            return _write_vtk(_unstructured(image), points)

        return Adapter(lambda image: _read_grid(_unstructured(image)), write, _annotate_vtk)
    if mesh.IsA("vtkMultiBlockDataSet"):
        return multi_block_adapter(vtk_adapter)
    raise TypeError(
        f"a {mesh.GetClassName()} has no elements of its own; make an unstructured grid of it"
    )


def _unstructured(mesh: Any) -> Any:
    """The same nodes, cells and arrays as an unstructured grid."""
    if hasattr(mesh, "cast_to_unstructured_grid"):
        return mesh.cast_to_unstructured_grid()
    filters = importlib.import_module("vtkmodules.vtkFiltersCore").vtkAppendFilter()
    filters.AddInputData(mesh)
    filters.Update()
    return filters.GetOutput()


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
