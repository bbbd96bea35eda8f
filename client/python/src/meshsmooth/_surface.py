"""Target surfaces: the triangles of a surface mesh, as they travel."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _wire
from ._adapters import read_mesh
from ._errors import InvalidMesh
from ._triangles import TRIANGLES
from .v1 import smoothing_pb2


class Surface(NamedTuple):
    """The surface on which the nodes of the boundary shall lie."""

    points: NDArray[np.float64]  # [points, 3]
    triangles: NDArray[np.int32]  # [triangles, 3]

    def spec(self) -> smoothing_pb2.SurfaceSpec:
        """Returns what the job announces of it."""
        return smoothing_pb2.SurfaceSpec(
            point_count=len(self.points), triangle_count=len(self.triangles)
        )

    def arrays(self) -> list[tuple[int, NDArray[Any]]]:
        """Returns its arrays in the order of the wire."""
        return [
            (_wire.SURFACE_POINTS, self.points),
            (_wire.SURFACE_TRIANGLES, self.triangles),
        ]


def read_surface(given: Any) -> Surface:
    """Returns the triangles of a surface mesh of any kind; quads are two, elements of second order
    those between all their nodes.

    Raises:
        InvalidMesh: SURFACE_INVALID: it has volume elements; others as of any mesh.
        TypeError: nothing is known of this kind of mesh.
    """
    try:
        mesh = read_mesh(given)
        blocks = mesh.cells.blocks
    except InvalidMesh as error:
        details = error.details | {"field": "surface"}
        message = f"surface: {error.message}"
        raise InvalidMesh(message, reason=error.reason, details=details, hint=error.hint) from error
    found = []
    for block in blocks:
        corners = TRIANGLES.get(block.element_type)
        if corners is None:
            raise InvalidMesh(
                "surface: the mesh has volume elements; give its boundary alone, as by PyVista's "
                "extract_surface()",
                reason="SURFACE_INVALID",
                details={"field": "surface"},
            )
        nodes = np.asarray(block.nodes)
        found += [nodes[:, list(triangle)] for triangle in corners]
    points = np.ascontiguousarray(mesh.points, np.dtype("<f8"))
    return Surface(points, np.ascontiguousarray(np.concatenate(found), np.dtype("<i4")))
