"""The model that is open in gmsh's own Python module.

import gmsh, meshsmooth as ms
gmsh.model.mesh.generate(3)
summary = ms.gmsh.smooth()
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import LazyArrays
from ._cell_types import WEDGE_OF_GMSH
from ._default import default_client
from ._errors import InvalidMesh
from ._job_options import MOVE_OPTIONS, JobOptions, MoveOptions
from ._mesh import MeshData
from ._result import SmoothResult
from ._signature import with_options
from ._summary import QualityStats, Summary

if TYPE_CHECKING:
    from typing_extensions import Unpack

# By gmsh's number of the type: our name, and our order of its nodes if it is another.
_TYPES: dict[int, tuple[str, list[int] | None]] = {
    15: ("vertex", None),
    1: ("line", None),
    2: ("triangle", None),
    3: ("quad", None),
    4: ("tetra", None),
    7: ("pyramid", None),
    6: ("wedge", WEDGE_OF_GMSH),
    5: ("hexahedron", None),
    8: ("line3", None),
    9: ("triangle6", None),
    16: ("quad8", None),
    10: ("quad9", None),
    11: ("tetra10", [*range(8), 9, 8]),
    19: ("pyramid13", [*range(5), 5, 8, 10, 6, 7, 9, 11, 12]),
    18: ("wedge15", [*WEDGE_OF_GMSH, 7, 9, 6, 13, 14, 12, 8, 11, 10]),
    13: ("wedge18", [*WEDGE_OF_GMSH, 7, 9, 6, 13, 14, 12, 8, 11, 10, 16, 17, 15]),
    17: ("hexahedron20", [*range(8), 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15]),
    12: (
        "hexahedron27",
        [*range(8), 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26],
    ),
}


def read() -> MeshData:
    """Returns the mesh of the open model; ids are gmsh's tags, sets are physical groups.

    Raises:
        InvalidMesh: MESH_EMPTY, or ELEMENT_NOT_SUPPORTED for elements of an order above 2.
    """
    gmsh: Any = importlib.import_module("gmsh")
    if not gmsh.isInitialized():
        raise InvalidMesh(
            "gmsh is not initialized, so no model is open",
            reason="MESH_EMPTY",
            hint="call gmsh.initialize() and open or make a model first",
        )
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    if len(tags) == 0:
        raise InvalidMesh("the model open in gmsh has no mesh", reason="MESH_EMPTY")
    node_ids = np.asarray(tags, np.int64)
    index = np.full(node_ids.max() + 1, -1, np.int64)
    index[node_ids] = np.arange(len(node_ids))

    blocks, cell_ids, entities, physical = [], [], [], []
    groups: dict[tuple[int, ...], int] = {(): 0}  # a number for each set of physical groups
    for dimension, entity in gmsh.model.getEntities():
        own = tuple(gmsh.model.getPhysicalGroupsForEntity(dimension, entity))
        group = groups.setdefault(own, len(groups))
        kinds, ids_by_kind, node_tags = gmsh.model.mesh.getElements(dimension, entity)
        for kind, elements, nodes in zip(kinds, ids_by_kind, node_tags, strict=True):
            name, order = _type_of(gmsh, kind, elements)
            rows = index[np.asarray(nodes, np.int64)].reshape(len(elements), -1)
            blocks.append((name, rows if order is None else rows[:, order]))
            cell_ids.append(np.asarray(elements, np.int64))
            entities.append(np.full(len(elements), entity))
            physical.append(np.full(len(elements), group))
    if not blocks:
        raise InvalidMesh("the model open in gmsh has no elements", reason="MESH_EMPTY")
    cell_data = {"gmsh:physical": np.concatenate(physical)}
    cell_data["gmsh:geometrical"] = np.concatenate(entities)
    return MeshData(
        np.asarray(coordinates).reshape(-1, 3),
        blocks,
        cell_data=cell_data,
        node_sets=_groups(gmsh, index),
        cell_ids=np.concatenate(cell_ids),
        node_ids=node_ids,
        node_pairs=_pairs(gmsh, index),
    )


def _pairs(gmsh: Any, index: NDArray[np.int64]) -> NDArray[np.int64] | None:
    """The nodes of periodic entities and those of their masters."""
    links = [
        gmsh.model.mesh.getPeriodicNodes(dimension, tag, includeHighOrderNodes=True)[1:3]
        for dimension, tag in gmsh.model.getEntities()
        if dimension < 3
    ]
    pairs = [np.stack(link, axis=1).astype(np.int64) for link in links if len(link[0]) > 0]
    return index[np.concatenate(pairs)] if pairs else None


def _type_of(gmsh: Any, kind: int, elements: Any) -> tuple[str, list[int] | None]:
    found = _TYPES.get(kind)
    if found is not None:
        return found
    error = InvalidMesh(
        f"element {elements[0]} is of the type {gmsh.model.mesh.getElementProperties(kind)[0]}; "
        "only triangles, quads, tetrahedra, pyramids, wedges and hexahedra of first and second "
        "order can be smoothed",
        reason="ELEMENT_NOT_SUPPORTED",
        hint="gmsh.model.mesh.setOrder(2)",
    )
    error.element = int(elements[0])
    raise error


def _groups(gmsh: Any, index: NDArray[np.int64]) -> LazyArrays:
    named: dict[str, list[tuple[int, int]]] = {}
    for dimension, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(dimension, tag)
        if name:
            named.setdefault(name, []).append((dimension, tag))

    def nodes(name: str) -> NDArray[Any]:
        tags = [gmsh.model.mesh.getNodesForPhysicalGroup(d, tag)[0] for d, tag in named[name]]
        return index[np.unique(np.concatenate(tags)).astype(np.int64)]

    return LazyArrays(list(named), nodes)


def write(before: MeshData, points: NDArray[np.float64]) -> int:
    """Sets the nodes of the open model that have moved; returns how many.

    gmsh has no call for many nodes at once: 7 us a node.
    """
    gmsh: Any = importlib.import_module("gmsh")
    assert before.node_ids is not None
    moved = np.flatnonzero((points != np.asarray(before.points)).any(axis=1))
    set_node = gmsh.model.mesh.setNode
    # Positions only: the parametric coordinates on curves and surfaces are gmsh's own matter.
    for tag, point in zip(before.node_ids[moved].tolist(), points[moved].tolist(), strict=True):
        set_node(tag, point, [])
    return len(moved)


@with_options()
def smooth(**options: Unpack[JobOptions]) -> Summary:
    """Smooths the mesh of the open model in place and returns the report.

    `fixed` may be the name of a physical group, or indices in the order of
    `gmsh.model.mesh.getNodes()`. Interfaces between physical groups, or between volumes where there
    are none, are kept (`regions="auto"`).

    Raises:
        ModuleNotFoundError: gmsh is not installed.
        Error: as `meshsmooth.smooth`, with gmsh's tags of elements and nodes.
    """
    before = read()
    result: SmoothResult[Any] = default_client().smooth(before, full=True, **options)
    write(before, result.points)
    return result.summary


@with_options(MOVE_OPTIONS)
def move(**options: Unpack[MoveOptions]) -> Summary:
    """Moves nodes of the open model, lets the rest follow and returns the report.

    `prescribed` may be the name of a physical group; arrays are in the order of
    `gmsh.model.mesh.getNodes()`.

    Raises:
        ModuleNotFoundError: gmsh is not installed.
        Error: as `meshsmooth.move`, with gmsh's tags of elements and nodes.
    """
    before = read()
    result: SmoothResult[Any] = default_client().move(before, full=True, **options)
    write(before, result.points)
    return result.summary


@with_options()
def quality(**options: Unpack[JobOptions]) -> QualityStats:
    """Evaluates the mesh of the open model; see `meshsmooth.quality`."""
    return default_client().quality(read(), **options)
