"""Target surfaces as they travel."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import cube

import meshsmooth as ms
from meshsmooth import _options, _surface, _wire
from meshsmooth._adapters import read_mesh
from meshsmooth._request import Request
from meshsmooth._topology import TopologyUse
from meshsmooth.v1 import smoothing_pb2

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]], float)
TETRAHEDRON = (POINTS, {"tetra": np.array([[0, 1, 2, 3]])})


def test_reads_triangles_and_quads() -> None:
    """A quad is two triangles."""
    surface = _surface.read_surface((POINTS, {"triangle": [[0, 1, 2]], "quad": [[0, 1, 4, 2]]}))
    assert surface.points.dtype == np.float64
    assert sorted(map(sorted, surface.triangles.tolist())) == [[0, 1, 2], [0, 1, 4], [0, 2, 4]]


def test_refuses_volume_elements() -> None:
    """The boundary alone is a surface."""
    with pytest.raises(ms.InvalidMesh, match="volume elements") as caught:
        _surface.read_surface(TETRAHEDRON)
    assert caught.value.reason == "SURFACE_INVALID"


def test_names_the_surface_in_errors() -> None:
    """Of a surface without triangles, not of the mesh."""
    with pytest.raises(ms.InvalidMesh, match="surface: the mesh has no surface") as caught:
        _surface.read_surface((POINTS, {"line": [[0, 1]]}))
    assert caught.value.reason == "MESH_EMPTY"
    assert caught.value.details == {"field": "surface"}


def test_slides_on_the_surface() -> None:
    """The policy follows; another one is a contradiction."""
    surface = (POINTS, {"triangle": [[0, 1, 2]]})
    request = Request(read_mesh(TETRAHEDRON), {"surface": surface})
    assert request.message.boundary_policy == smoothing_pb2.BOUNDARY_POLICY_SLIDE
    with pytest.raises(ms.InvalidOption, match="boundary"):
        _options.slide_on_surface({"surface": surface, "boundary": "free"})


@pytest.mark.parametrize("method", ["laplacian", "hc-laplacian", ms.Taubin(), ms.Move()])
def test_belongs_to_optimize(method: Any) -> None:
    """Of every other method it would change nothing."""
    surface = (POINTS, {"triangle": [[0, 1, 2]]})
    with pytest.raises(ms.InvalidOption, match="surface belongs to") as caught:
        Request(read_mesh(TETRAHEDRON), {"surface": surface, "method": method})
    assert caught.value.reason == "OPTION_MISPLACED"


def test_sends_its_arrays_last() -> None:
    """In the order of the wire, and announced."""
    surface = (POINTS, {"triangle": [[0, 1, 2], [0, 1, 3]]})
    request = Request(read_mesh(TETRAHEDRON), {"surface": surface})
    use = TopologyUse(named=False, kept=False)
    spec = request.spec(use, with_progress=False).spec
    assert (spec.surface.point_count, spec.surface.triangle_count) == (5, 2)
    ids = [part.array_id for part in request.parts(use)]
    assert ids[-2:] == [_wire.SURFACE_POINTS, _wire.SURFACE_TRIANGLES]


def box(lower: float, upper: float) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The surface of a cube, as two triangles a side."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    halves = [(a, b, c) for a, b, c, _ in sides] + [(a, c, d) for a, _, c, d in sides]
    return lower + (upper - lower) * corners, {"triangle": np.array(halves)}


def test_brings_the_boundary_onto_a_surface(server: str) -> None:
    """All nodes, corners included."""
    with ms.Client(server) as client:
        result = client.smooth(cube(5), surface=box(-0.02, 1.03), full=True)
    fit = result.summary.fit
    assert fit is not None
    assert (fit.reached, fit.held_count) == (1.0, 0)
    assert (fit.surface.patch_count, fit.surface.curve_count, fit.surface.corner_count) == (
        6,
        12,
        8,
    )
    points = result.points
    assert (points.min(), points.max()) == (-0.02, 1.03)
    assert np.isin(points, (-0.02, 1.03)).all(axis=1).sum() == 8
    assert "lie on the surface" in str(result.summary)


@pytest.mark.parametrize("wrong", ["index", "nan", "flat", "far"])
def test_names_what_is_wrong_with_a_surface(server: str, wrong: str) -> None:
    """The server finds it."""
    points, cells = box(0, 1)
    if wrong == "index":
        cells["triangle"][4, 1] = 8
    elif wrong == "flat":
        points[:, 1:] = 0
    else:
        points[2, 2] = np.nan if wrong == "nan" else 1e70
    with (
        ms.Client(server) as client,
        pytest.raises(ms.InvalidMesh, match="target surface") as caught,
    ):
        client.smooth(cube(3), surface=(points, cells))
    assert caught.value.reason == "SURFACE_INVALID"
