"""The regions of a mesh, whose interfaces are kept."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import as_array
from ._errors import InvalidOption, out_of_range
from ._mesh import Mesh, unknown_name

# Cell arrays that tell regions, as the command line takes them: Gmsh's physical groups, Medit's
# references, TetGen's first attribute, Gmsh's entities; in files that it converted, the materials
# of Abaqus, the cell zones of OpenFOAM and the zones of SU2.
_REGION_ARRAYS = (
    "gmsh:physical",
    "medit:ref",
    "tetgen:attribute_0",
    "gmsh:geometrical",
    "abaqus:material",
    "foam:cell_zone",
    "su2:zone",
)

_OF_NODES = "it is an array of the nodes (PyVista: image.points_to_cells(), of an image)"


def element_regions(mesh: Mesh, regions: Any, free_boundary: bool) -> NDArray[np.int32] | None:
    """Returns the region of each element, or None if there is only one.

    Args:
        mesh: the mesh.
        regions: "auto", None, the name of a cell array, or one whole number per cell or element.
        free_boundary: nodes between regions are free too.
    """
    automatic = isinstance(regions, str) and regions == "auto"
    if regions is None or (automatic and free_boundary):
        return None
    if free_boundary:
        raise InvalidOption(
            'regions mean nothing with boundary="free", which frees interfaces too',
            reason="OPTION_MISPLACED",
            details={"field": "regions"},
        )
    if automatic:
        for name in _REGION_ARRAYS:
            if name in mesh.data.cell_data:
                values = _per_element(mesh, mesh.data.cell_data[name], name)
                if values.any():
                    return _numbered(mesh, values, name)
        return None
    if isinstance(regions, str):
        if regions not in mesh.data.cell_data:
            of_nodes = regions in mesh.data.point_data
            raise unknown_name(
                "no cell array of one number a cell",
                regions,
                mesh.data.cell_data,
                hint=_OF_NODES if of_nodes else "",
            )
        return _numbered(mesh, _per_element(mesh, mesh.data.cell_data[regions], regions), regions)
    return _numbered(mesh, _per_element(mesh, regions, "regions"), "regions")


def _per_element(mesh: Mesh, values: ArrayLike, name: str) -> NDArray[Any]:
    array = as_array(values, name)
    cells = mesh.cells
    if array.shape == (cells.cell_count,):
        where = cells.element_cells
        return array[: cells.element_count] if where is None else array[where]
    if array.shape == (cells.element_count,):
        return array
    raise out_of_range(
        "regions",
        f'the cell array "{name}" has the shape {array.shape}, the mesh has {cells.cell_count} '
        "cells",
    )


def _numbered(mesh: Mesh, values: NDArray[Any], name: str) -> NDArray[np.int32] | None:
    if values.dtype.kind == "f":
        attribute = name.startswith("tetgen:attribute_")
        wrong = np.isnan(values) if attribute else np.trunc(values) != values
        if wrong.any():
            element = int(np.flatnonzero(wrong)[0])
            raise InvalidOption(
                f'the cell array "{name}" gives no regions: element {mesh.caller_element(element)} '
                f"has {values[element]}, which is not a whole number",
                reason="ARRAY_NOT_WHOLE",
                details={"name": name},
            )
    found, numbers = np.unique(values, return_inverse=True)
    if len(found) < 2:
        return None
    return np.ascontiguousarray(numbers.reshape(-1), np.dtype("<i4"))
