"""Target surfaces as they travel."""

from __future__ import annotations

import numpy as np
import pytest

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


def test_slides_on_the_surface() -> None:
    """The policy follows; another one is a contradiction."""
    surface = (POINTS, {"triangle": [[0, 1, 2]]})
    request = Request(read_mesh(TETRAHEDRON), {"surface": surface})
    assert request.message.boundary_policy == smoothing_pb2.BOUNDARY_POLICY_SLIDE
    with pytest.raises(ms.InvalidOption, match="boundary"):
        _options.slide_on_surface({"surface": surface, "boundary": "free"})


def test_sends_its_arrays_last() -> None:
    """In the order of the wire, and announced."""
    surface = (POINTS, {"triangle": [[0, 1, 2], [0, 1, 3]]})
    request = Request(read_mesh(TETRAHEDRON), {"surface": surface})
    use = TopologyUse(named=False, kept=False)
    spec = request.spec(use, with_progress=False).spec
    assert (spec.surface.point_count, spec.surface.triangle_count) == (5, 2)
    ids = [part.array_id for part in request.parts(use)]
    assert ids[-2:] == [_wire.SURFACE_POINTS, _wire.SURFACE_TRIANGLES]
