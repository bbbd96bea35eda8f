"""`move`: what travels, what is refused before it does, and what a real server makes of it."""

from __future__ import annotations

import asyncio
import collections
from collections.abc import Iterator
from typing import Any

import grpc
import numpy as np
import pytest
from adapters_test import SETTINGS, Lookalike, assert_same
from conftest import cube
from hypothesis import given
from meshes import CASES, Case
from scripted_server import Call, MockServer, mock_server

import meshsmooth as ms
from meshsmooth import _facets
from meshsmooth._cells import parse_cells

Kind = type[ms.Client] | type[ms.AsyncClient]
KINDS = pytest.mark.parametrize("kind", [ms.Client, ms.AsyncClient])

POINTS = np.arange(15, dtype=float).reshape(5, 3)
TETRA = {"tetra": np.array([[0, 1, 2, 3], [1, 2, 3, 4]])}
RESULT = (POINTS + 0.5).tobytes()

MESH = cube(5)
OUTER = ((MESH[0] == 0) | (MESH[0] == 1)).any(axis=1)
MOTION = 0.1 * np.sin(3 * MESH[0][:, [1, 2, 0]])


@pytest.fixture
def mock() -> Iterator[MockServer]:
    with mock_server() as server:
        yield server


def steps(kind: Kind, address: str, mesh: Any, *calls: Any, **keywords: Any) -> list[Any]:
    """The results of `session.move` with these arguments, one call after the other."""
    if kind is ms.Client:
        with ms.Client(address) as client, client.session(mesh) as session:
            return [session.move(*arguments, **keywords) for arguments in calls]

    async def run() -> list[Any]:
        async with ms.AsyncClient(address) as client, client.session(mesh) as session:
            return [await session.move(*arguments, **keywords) for arguments in calls]

    return asyncio.run(run())


# --- the wire ------------------------------------------------------------------------------------


@KINDS
def test_what_travels(mock: MockServer, kind: Kind) -> None:
    specs, uploads = [], []

    def lost(call: Call) -> None:
        specs.append(call.read_spec())
        call.stop_sending()
        call.read_rest()
        call.refuse(grpc.StatusCode.NOT_FOUND, "TOPOLOGY_NOT_FOUND", "gone")

    def take(call: Call) -> None:
        specs.append(call.read_spec())
        call.accept()
        uploads.append(call.read_upload())
        call.succeed(RESULT)

    mock.scripts = [lost, take, take]
    moved = np.array([[9.0, 8, 7], [6, 5, 4]])
    results = steps(kind, mock.address, (POINTS, TETRA), ([3, 1], moved), ([3], moved[:1]))
    assert [result.tobytes() for result in results] == [RESULT, RESULT]
    named, inline, again = specs
    assert named.topology_name == again.topology_name
    assert inline.topology_kept
    assert inline.inline_topology.reference_type == inline.coordinate_type == 2
    assert [spec.prescribed_node_count for spec in specs] == [2, 2, 1]
    assert all(spec.options.HasField("move") for spec in specs)
    assert list(uploads[0]) == [1, 5, 7, 8]
    assert uploads[0][5] == POINTS.tobytes()
    assert uploads[0][7] == np.array([3, 1], "<i4").tobytes()
    assert uploads[0][8] == moved.tobytes()
    assert list(uploads[1]) == [7, 8]


# --- the boundary --------------------------------------------------------------------------------


@SETTINGS
@given(CASES)
def test_boundary_is_what_one_element_has(case: Case) -> None:
    cells = parse_cells(case.blocks())
    facets = collections.Counter(
        tuple(sorted(element[list(facet)].tolist()))
        for block in cells.blocks
        for element in block.nodes
        for facet in _facets._FACETS[block.element_type]
    )
    expected = {node for facet, count in facets.items() if count == 1 for node in facet}
    assert _facets.boundary_nodes(cells.blocks, len(case.points)).tolist() == sorted(expected)


# --- the mesh of a call --------------------------------------------------------------------------


def test_ways_to_say_where(client: ms.Client) -> None:
    points, cells = MESH
    given_motion = MOTION.copy()
    given_motion[~OUTER] = np.nan  # does not count
    expected = client.move(MESH, displacement=given_motion)
    assert type(expected) is tuple
    assert expected[1] is cells
    assert (expected[0][OUTER] == (points + MOTION)[OUTER]).all()
    assert (expected[0][~OUTER] != points[~OUTER]).all()
    mesh = ms.MeshData(
        points,
        cells,
        point_data={"u": MOTION, "t": points[:, 0]},
        node_sets={"wall": OUTER.nonzero()[0]},
    )
    for options in (
        {"displacement": "u"},
        {"to": points + MOTION},
        {"to": (points + MOTION, cells)},
        {"displacement": MOTION, "prescribed": OUTER},
        {"displacement": MOTION, "prescribed": OUTER.nonzero()[0][::-1]},
        {"displacement": "u", "prescribed": "wall", "method": ms.Move()},
    ):
        assert_same(client.move(mesh, **options).points, expected[0])
    out = points.copy()
    assert client.move((out, cells), displacement=MOTION, out=out) is out
    assert_same(out, expected[0])
    with pytest.raises(ms.InvalidOption, match="known are 'u'"):
        client.move(mesh, displacement="t")
    with pytest.raises(ms.InvalidOption, match="known are 'wall', 't'"):
        client.move(mesh, displacement="u", prescribed="u")


def test_other_kinds_of_meshes(client: ms.Client) -> None:
    rows = [("line", (0, 1)), *(("tetra", tuple(map(int, row))) for row in MESH[1]["tetra"])]
    mesh = Lookalike(Case(MESH[0], rows))
    better = client.move(mesh, displacement=MOTION)
    assert type(better) is Lookalike
    # The line's nodes are prescribed, so the line does not hold them.
    assert_same(better.points, client.move(MESH, displacement=MOTION)[0])


@pytest.mark.usefixtures("server")
def test_plane_mesh_of_single_precision() -> None:
    axis = np.linspace(0, 1, 6, dtype=np.float32)
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    first = (np.arange(5)[:, None] * 6 + np.arange(5)).reshape(-1, 1)
    quads = {"quad": first + np.array([0, 1, 7, 6])}
    right = points[:, 0] == 1
    result = ms.move(
        (points, quads), displacement=right[:, None] * [0.5, 0.2], full=True, fixed=[0]
    )
    assert (result.points.dtype, result.points.shape) == (np.float32, (36, 2))
    assert (result.points[right] == points[right] + np.float32([0.5, 0.2])).all()
    motion = result.summary.motion
    assert motion is not None
    assert (motion.reached, motion.step_count) == (1, 1)
    assert str(result).startswith("reached 100 % of the motion in 1 step; ")


def test_motion_that_is_too_hard(client: ms.Client) -> None:
    points, cells = MESH
    through = np.where(points[:, 2:] == 1, [0, 0, -2.0], 0)
    mesh = (points, {"line": [[0, 1]], **cells})
    result = client.move(mesh, displacement=through, full=True)
    motion = result.summary.motion
    assert motion is not None
    assert 0 < motion.reached < 1
    assert np.allclose(result.points[OUTER], (points + motion.reached * through)[OUTER])
    assert client.quality(result.mesh).inverted_element_count == 0
    text = f"reached {100 * motion.reached:.4g} % of the motion"
    assert text in str(result)
    assert text in result._repr_html_()
    # The line is the caller's element 0.
    wanted = client.move(MESH, displacement=through, full=True).summary.motion
    assert wanted is not None
    assert motion.blocking_elements == tuple(e + 1 for e in wanted.blocking_elements)
    with pytest.warns(RuntimeWarning, match=r"move reached 0 % of the motion"):
        once = client.move(mesh, displacement=through, method=ms.Move(least_step=1))
    assert_same(once[0], points)


def test_kept_job(client: ms.Client) -> None:
    result = client.move(MESH, displacement=MOTION, result_ttl="10min", full=True)
    assert_same(client.attach(result.job_name, MESH).result(60)[0], result.points)


# --- sessions ------------------------------------------------------------------------------------


@KINDS
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_steps_do_not_depend_on_those_before(client: ms.Client, kind: Kind, dtype: Any) -> None:
    mesh = (MESH[0].astype(dtype), MESH[1])
    there = mesh[0] + MOTION
    nodes = OUTER.nonzero()[0].astype(np.uint16)[::-1]
    calls = [(OUTER, there[OUTER]), (OUTER, mesh[0]), (nodes, there[nodes]), (OUTER, there)]
    first, back, again, once_more = steps(kind, client.address, mesh, *calls, full=True)
    expected = client.move(mesh, to=there)[0]
    for result in (first, again, once_more):
        assert_same(result.points, expected)
    assert_same(back.points, mesh[0])
    assert again.summary.execution.topology_reused
    assert (first.points[OUTER] == there.astype(dtype)[OUTER]).all()


def test_session_keeps_its_reference(client: ms.Client) -> None:
    points = MESH[0].copy()
    expected = client.move(MESH, displacement=MOTION)[0]
    with client.session((points, MESH[1])) as session:
        points += MOTION
        session.move(OUTER, points, out=points)
        assert_same(points, expected)
        moving = session._steps._moving
        assert moving is not None
        assert client.topology(moving.name).element_count == len(MESH[1]["tetra"])
        client.delete_topology(moving.name)
        assert_same(session.move(OUTER, MESH[0] + MOTION), expected)  # sends it again
        assert session.smooth(points).shape == points.shape
        assert session.move(OUTER, MESH[0], target="ideal").shape == points.shape


def test_cells_of_lower_dimension_hold_other_nodes(client: ms.Client) -> None:
    points, cells = MESH
    inner = int(np.flatnonzero(~OUTER)[0])
    mesh = (points, {"line": [[inner, 0]], **cells})
    with client.session(mesh) as session:
        held = session.move(OUTER, points + MOTION)
        assert (held[inner] == points[inner]).all()
        assert (held[0] == points[0] + MOTION[0]).all()
        both = np.append(OUTER.nonzero()[0], inner)
        assert (session.move(both, points + MOTION)[both] == (points + MOTION)[both]).all()


# --- what is refused -----------------------------------------------------------------------------

WRONG: list[tuple[Any, Any, str, int | None]] = [
    ([], np.zeros((0, 3)), "OPTION_OUT_OF_RANGE", None),
    ([0.5], [[0, 0, 0]], "OPTION_OUT_OF_RANGE", None),
    (np.zeros(7, bool), MESH[0], "OPTION_OUT_OF_RANGE", None),
    (OUTER.astype(int), MESH[0], "OPTION_OUT_OF_RANGE", None),
    ([0, 125], MESH[0], "INDEX_OUT_OF_RANGE", 125),
    ([-1], MESH[0], "INDEX_OUT_OF_RANGE", -1),
    ([4, 2, 4], MESH[0], "PRESCRIBED_TWICE", 4),
    ([4, 3], MESH[0], "PRESCRIBED_AND_FIXED", 3),
    ([4, 2], MESH[0][:3], "ARRAY_SIZE_MISMATCH", None),
    ([4, 2], MESH[0][:2, :2], "ARRAY_SIZE_MISMATCH", None),
    ([4], 0.5, "ARRAY_SIZE_MISMATCH", None),
    ([4, 2], [[0, 0, 0], [0, np.nan, 0]], "NON_FINITE_COORDINATE", 2),
]


@pytest.mark.parametrize(("nodes", "positions", "reason", "node"), WRONG)
def test_refused_before_anything_is_sent(
    nodes: Any, positions: Any, reason: str, node: int | None
) -> None:
    session = ms.Client("unix:/nowhere").session(MESH, fixed=[3])
    with pytest.raises((ms.InvalidMesh, ms.InvalidOption)) as caught:
        session.move(nodes, positions)
    assert caught.value.reason == reason
    assert getattr(caught.value, "node", None) == node


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({}, "OPTION_MISPLACED"),
        ({"displacement": MOTION, "to": MESH[0]}, "OPTION_MISPLACED"),
        ({"displacement": MOTION, "method": "taubin"}, "OPTION_MISPLACED"),
        ({"displacement": MOTION, "goal": "worst"}, "OPTION_MISPLACED"),
        ({"displacement": MOTION, "reference": MESH[0]}, "OPTION_MISPLACED"),
        ({"displacement": MOTION[:-1]}, "ARRAY_SIZE_MISMATCH"),
        ({"displacement": "u"}, "NAME_UNKNOWN"),
        ({"to": (MESH[0], {"tetra": MESH[1]["tetra"][::-1]})}, "REFERENCE_DIFFERS"),
        ({"displacement": MOTION + np.inf}, "NON_FINITE_COORDINATE"),
        ({"displacement": MOTION, "prescribed": [1, 1]}, "PRESCRIBED_TWICE"),
        ({"displacement": MOTION, "prescribed": [500]}, "INDEX_OUT_OF_RANGE"),
        ({"displacement": MOTION, "fixed": OUTER}, "OPTION_OUT_OF_RANGE"),
    ],
)
def test_options_that_are_refused(options: Any, reason: str) -> None:
    with ms.Client("unix:/nowhere") as client, pytest.raises(ms.Error) as caught:
        client.move(MESH, **options)
    assert caught.value.reason == reason
    assert isinstance(caught.value, ValueError)


def test_smooth_does_not_move() -> None:
    with ms.Client("unix:/nowhere") as client, pytest.raises(ms.InvalidOption, match=r"move\(…\)"):
        client.smooth(MESH, method="move")
    with ms.Client("unix:/nowhere") as client, pytest.raises(TypeError, match="displacment"):
        client.move(MESH, displacment=MOTION)  # type: ignore[call-overload]


def test_errors_have_the_callers_numbers() -> None:
    mesh = ms.MeshData(*MESH, node_ids=np.arange(1001, 1126))
    with ms.Client("unix:/nowhere") as client, pytest.raises(ms.InvalidMesh) as caught:
        client.session(mesh).move([7, 7], MESH[0])
    assert caught.value.node == 1008
    assert "in the input: node 1008" in str(caught.value)


def test_refused_by_the_server(client: ms.Client) -> None:
    tangled = MESH[0].copy()
    tangled[~OUTER] = 2
    with pytest.raises(ms.InvalidMesh, match="smooth the mesh first") as caught:
        client.move((tangled, MESH[1]), displacement=MOTION)
    assert caught.value.reason == "REFERENCE_TANGLED"
    assert caught.value.element is not None
    with pytest.raises(ms.InvalidOption, match="least_step"):
        client.move(MESH, displacement=MOTION, method=ms.Move(least_step=2))
