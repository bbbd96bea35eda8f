"""A mesh of any kind comes back as the same kind, with the bits of the command line's result."""

from __future__ import annotations

import copy
import pathlib
import tempfile
import types
from typing import Any

import numpy as np
import pytest
from conftest import cube, run_cli
from hypothesis import HealthCheck, given, settings
from meshes import CASES, Case, read_vtk_points

import meshsmooth as ms

SETTINGS = settings(
    max_examples=15,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


def cli_points(case: Case, *arguments: str) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        source, target = (pathlib.Path(folder) / name for name in ("in.vtk", "out.vtk"))
        case.write_vtk(source)
        done = run_cli("smooth", source, "-o", target, "--quiet", *arguments)
        assert done.returncode == 0, done.stderr
        return read_vtk_points(target)


def assert_same(points: Any, expected: Any) -> None:
    assert points.dtype == expected.dtype
    assert points.shape == expected.shape
    assert points.tobytes() == expected.tobytes()


def assert_unchanged(value: Any, before: Any) -> None:
    if isinstance(value, np.ndarray):
        assert value.dtype == before.dtype
        assert value.tobytes() == before.tobytes()
    elif isinstance(value, dict):
        assert list(value) == list(before)
        for name in value:
            assert_unchanged(value[name], before[name])
    elif isinstance(value, list | tuple):
        assert len(value) == len(before)
        for one, other in zip(value, before, strict=True):
            assert_unchanged(one, other)
    else:
        assert value == before


@SETTINGS
@given(CASES)
def test_arrays_in_every_layout(client: ms.Client, case: Case) -> None:
    expected = cli_points(case)
    layouts: list[Any] = [
        case.blocks(),
        (case.padded(), case.types()),
        (case.offsets(), case.connectivity(), case.types()),
    ]
    for cells in layouts:
        points = case.points.copy()
        cells_before = copy.deepcopy(cells)
        better = client.smooth((points, cells))
        assert type(better) is tuple
        assert len(better) == 2
        assert better[1] is cells
        assert_unchanged(cells, cells_before)
        assert_unchanged(points, case.points)
        assert_same(better[0], expected)


@SETTINGS
@given(CASES)
def test_arrays_by_type(client: ms.Client, case: Case) -> None:
    cells = case.by_type()
    better = client.smooth((case.points, cells))
    assert better[1] is cells
    assert_same(better[0], cli_points(case.sorted_by_type()))


@SETTINGS
@given(CASES)
def test_triples_of_dolfinx(client: ms.Client, case: Case) -> None:
    cells, kinds = case.padded().astype(np.int32), case.types()
    better = client.smooth((cells, kinds, case.points))
    assert type(better) is tuple
    assert better[0] is cells
    assert better[1] is kinds
    assert_same(better[2], cli_points(case))


class Lookalike:
    """Has meshio's attributes, as its forks have."""

    def __init__(self, case: Case) -> None:
        self.points = case.points
        self.cells = [types.SimpleNamespace(type=n, data=a) for n, a in case.meshio_blocks()]
        self.point_data: dict[str, Any] = {"t": np.arange(len(case.points))}
        self.cell_data: dict[str, Any] = {"c": [np.arange(len(b.data)) for b in self.cells]}
        self.cell_sets: dict[str, Any] = {}
        self.point_sets: dict[str, Any] = {}


@SETTINGS
@given(CASES)
def test_what_looks_like_meshio(client: ms.Client, case: Case) -> None:
    mesh = Lookalike(case)
    better = client.smooth(mesh)
    assert type(better) is Lookalike
    assert better is not mesh
    assert better.cells == mesh.cells  # of the same blocks
    assert better.cells is not mesh.cells
    assert_unchanged(better.point_data, mesh.point_data)
    assert better.point_data is not mesh.point_data
    assert_unchanged(better.cell_data, mesh.cell_data)
    assert mesh.points is case.points
    assert_same(better.points, cli_points(case))


@SETTINGS
@given(CASES)
def test_out_has_the_same_bits(client: ms.Client, case: Case) -> None:
    expected = client.smooth((case.points, case.blocks()))[0]
    in_place = case.points.copy()
    assert client.smooth((in_place, case.blocks()), out=in_place) is in_place
    assert_same(in_place, expected)
    other = np.empty_like(case.points)
    client.smooth((case.points, case.blocks()), out=other)
    assert_same(other, expected)


class Trimesh:
    def __init__(self, vertices: Any, faces: Any) -> None:
        self.vertices, self.faces = vertices, faces

    def copy(self) -> Trimesh:
        return Trimesh(self.vertices.copy(), self.faces.copy())


def test_what_looks_like_trimesh(client: ms.Client) -> None:
    points, cells = cube(4)
    surface = np.array([[0, 1, 5], [0, 5, 4], [4, 5, 9], [4, 9, 8], [1, 2, 6], [1, 6, 5]])
    mesh = Trimesh(points[:16].copy(), surface)
    better = client.smooth(mesh, boundary="free", iterations=3, method="laplacian")
    assert type(better) is Trimesh
    assert_unchanged(mesh.vertices, points[:16])
    rows = [("triangle", tuple(map(int, row))) for row in surface]
    options = ("--boundary", "free", "--iterations", "3", "--method", "laplacian")
    assert_same(better.vertices, cli_points(Case(points[:16], rows), *options))
    del cells


def test_planar_points_keep_their_shape(client: ms.Client) -> None:
    square = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [0.7, 1.4]], np.float32)
    faces = {"triangle": np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])}
    better, _ = client.smooth((square, faces))
    assert better.dtype == np.float32
    assert better.shape == (5, 2)
    assert np.allclose(better[4], [1, 1], atol=0.05)


@pytest.mark.parametrize("dtype", [">f8", ">f4", "<f8", "float16", "int64"])
def test_the_type_of_the_points_returns(client: ms.Client, dtype: str) -> None:
    points, cells = cube(4)
    given_points = np.round(points * 3).astype(dtype) if dtype == "int64" else points.astype(dtype)
    better, _ = client.smooth((given_points, cells))
    assert better.dtype == (np.float64 if dtype == "int64" else np.dtype(dtype))


def test_fortran_order_and_strides(client: ms.Client) -> None:
    points, cells = cube(4)
    expected, _ = client.smooth((points, cells))
    assert_same(
        np.ascontiguousarray(client.smooth((np.asfortranarray(points), cells))[0]), expected
    )
    wide = np.zeros((len(points), 5))
    wide[:, 1:4] = points
    client.smooth((points, cells), out=wide[:, 1:4])
    assert_same(wide[:, 1:4].copy(), expected)
    assert not wide[:, [0, 4]].any()


class Ball:
    def __init__(self, points: Any, cells: Any, label: str) -> None:
        self.points_of_ball, self.cells_of_ball, self.label = points, cells, label


def test_registered_adapter(client: ms.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    from meshsmooth import _adapters

    monkeypatch.setattr(_adapters, "_registered", [])
    points, cells = cube(4)
    ball = Ball(points, cells, "round")
    with pytest.raises(TypeError, match=r"Ball.*register_adapter"):
        client.smooth(ball)
    ms.register_adapter(
        Ball,
        read=lambda b: (b.points_of_ball, b.cells_of_ball),
        write=lambda b, p: Ball(p, b.cells_of_ball, b.label),
    )
    better = client.smooth(ball)
    assert type(better) is Ball
    assert better.label == "round"
    assert_same(better.points_of_ball, client.smooth((points, cells))[0])


@pytest.mark.parametrize(
    ("cells", "reason"),
    [
        ({}, "MESH_EMPTY"),
        ({"line": [[0, 1]]}, "MESH_EMPTY"),
        ({"tetra20": np.zeros((1, 20), int)}, "ELEMENT_NOT_SUPPORTED"),
        ((np.array([2, 0, 1, 3, 0, 1, 2]), np.array([3, 71])), "ELEMENT_NOT_SUPPORTED"),
        ((np.array([5, 0, 1, 2, 3, 4]), np.array([7])), "ELEMENT_NOT_SUPPORTED"),
        ({"tetra": [[0, 1, 2]]}, "ARRAY_SIZE_MISMATCH"),
        (np.zeros((1, 4), int), "ARRAY_SIZE_MISMATCH"),
        ((np.array([4, 0, 1, 2]), np.array([10])), "ARRAY_SIZE_MISMATCH"),
        ({"tetra": [[0.0, 1, 2, 3]]}, "ARRAY_SIZE_MISMATCH"),
        ({"tetra": [[0, 1, 2, 2**40]]}, "INDEX_OUT_OF_RANGE"),
        ({"tetra": [[0, 1, 2, -1]]}, "INDEX_OUT_OF_RANGE"),
    ],
)
def test_bad_cells_are_refused_by_name(client: ms.Client, cells: Any, reason: str) -> None:
    with pytest.raises(ms.InvalidMesh) as caught:
        client.smooth((np.zeros((5, 3)), cells))
    assert caught.value.reason == reason
    assert isinstance(caught.value, ValueError)
