"""What callers write by mistake: each is taken as it is meant, or refused by name and place."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from conftest import cube

import meshsmooth as ms
from meshsmooth import _adapters

POINTS, CELLS = cube()
TETRA = CELLS["tetra"]
COUNT = len(TETRA)
FLAT = TETRA.reshape(-1)
OFFSETS = np.arange(0, 4 * COUNT + 1, 4)
TYPES = np.full(COUNT, 10, np.uint8)


class Dlpack:
    """An array that has DLPack alone."""

    def __init__(self, array: Any) -> None:
        self._array = array

    def __dlpack__(self, **keywords: Any) -> Any:
        return self._array.__dlpack__(**keywords)

    def __dlpack_device__(self) -> Any:
        return self._array.__dlpack_device__()


def flat(offsets: Any = OFFSETS, connectivity: Any = FLAT) -> Any:
    return (POINTS, (offsets, connectivity, TYPES))


def with_masked_row() -> Any:
    points = np.ma.array(POINTS, mask=False)
    points[5] = np.ma.masked
    return points


# What is given, the class of the error, and words of its text.
MESHES: list[tuple[str, Any, type[Exception], str]] = [
    ("rows of four", (POINTS, TETRA.tolist()), ms.InvalidMesh, r'name it, as in {"tetra": cells}'),
    ("rows of two lengths", (POINTS, [[0, 1, 2], [0, 1, 2, 3]]), ms.InvalidMesh, "cells cannot be"),
    ("numbers", (POINTS, [0, 1, 2]), TypeError, "are not known; they are {type: array}"),
    ("huge offsets", flat(OFFSETS + 10**9), ms.InvalidMesh, "must run from 0 to 3000"),
    ("shifted offsets", flat(OFFSETS - 4), ms.InvalidMesh, "run from -4 to 2996"),
    (
        "unsigned offsets",
        flat(OFFSETS[::-1].astype(np.uint64)),
        ms.InvalidMesh,
        "cell 0: its nodes",
    ),
    ("too short", flat(connectivity=FLAT[:-1]), ms.InvalidMesh, "from 0 to 2999"),
    ("too long", flat(connectivity=np.append(FLAT, 0)), ms.InvalidMesh, "from 0 to 3001"),
    (
        "a plural",
        (POINTS, {"tets": TETRA}),
        ms.InvalidMesh,
        "^element 0 has the unknown type 'tets'; only .*; did you mean 'tetra'",
    ),
    ("capitals", (POINTS, {"TETRA": TETRA}), ms.InvalidMesh, "did you mean 'tetra'"),
    ("a number as text", (POINTS, {"10": TETRA}), ms.InvalidMesh, "the number 10, 'tetra'"),
    (
        "another order",
        (POINTS, {"tetra20": TETRA}),
        ms.InvalidMesh,
        "unknown type 'tetra20'; only .*T[^;]*$",
    ),
    ("no name", (POINTS, {None: TETRA}), TypeError, "None is neither the name nor"),
    ("a set", (POINTS, {"tetra": {1, 2}}), TypeError, "type 'tetra' are a set, not an array"),
    ("types that are floats", (POINTS, (OFFSETS, FLAT, TYPES + 0.5)), ms.InvalidMesh, "float64"),
    (
        "types beyond 8 bits",
        (POINTS, (OFFSETS, FLAT, TYPES + np.int64(256))),
        ms.InvalidMesh,
        "266",
    ),
    ("offsets that are floats", flat(OFFSETS + 0.0), ms.InvalidMesh, "whole numbers.* float64"),
    ("truth values", (POINTS > 0.5, CELLS), ms.InvalidMesh, "type bool; they must be real"),
    ("an unknown number", (POINTS, {99: TETRA}), ms.InvalidMesh, "VTK cell type 99"),
    ("a polyhedron", (POINTS, {42: TETRA}), ms.InvalidMesh, r"polyhedron .*triangulate\(\)"),
    (
        "polygons of six nodes",
        (POINTS, (np.array([6, *range(6)]), np.array([7]))),
        ms.InvalidMesh,
        r"polygon of 6 nodes .*triangulate\(\)",
    ),
    (
        "counted from 1",
        (POINTS, {"tetra": TETRA + 1}),
        ms.InvalidMesh,
        "count .*from 1; subtract 1",
    ),
    ("flat points", (POINTS[:, :2], CELLS), ms.InvalidMesh, "points have 2 coordinates.* need 3"),
    ("a masked node", (with_masked_row(), CELLS), ms.InvalidMesh, "row 5 of the points is masked"),
    ("complex", (POINTS * 1j, CELLS), ms.InvalidMesh, "type complex128; they must be real"),
    ("text", (POINTS.astype(str), CELLS), ms.InvalidMesh, "must be real numbers"),
    ("objects", (np.full_like(POINTS, "x", object), CELLS), ms.InvalidMesh, "type object"),
    ("three meshes", ((POINTS, CELLS),) * 3, TypeError, "type builtins.tuple are not known"),
    ("a path", "part.vtu", TypeError, r"'part.vtu' is a path; .*pyvista\.read"),
]

OPTIONS: list[tuple[dict[str, Any], type[Exception], str]] = [
    ({"iteration": 5}, TypeError, "no option 'iteration'; did you mean iterations="),
    ({"inplace": True}, TypeError, "did you mean out="),
    ({"n_iter": 20}, TypeError, "did you mean iterations=.*absolute_tolerance, backend, boundary"),
    ({"iterations": -1}, ms.InvalidOption, "^iterations is -1"),
    ({"iterations": True}, ms.InvalidOption, "iterations is True, it must be a whole number"),
    ({"iterations": 2**40}, ms.InvalidOption, "a whole number of 32 bits"),
    ({"traceparent": "00-0-1-01"}, ms.InvalidOption, "traceparent is '00-0-1-01', it must have the format of W3C Trace Context"),
    ({"traceparent": 5}, ms.InvalidOption, "traceparent is 5, it must have the format of W3C Trace Context"),
    ({"request_id": 5}, ms.InvalidOption, "request_id is 5, it must be a UUID as text"),
    *(
        ({"max_attempts": count}, ms.InvalidOption, f"max_attempts is {count!r}, .* 1 or more")
        for count in (0, "3", 1.5, True)
    ),
    ({"progress": "yes"}, ms.InvalidOption, "progress is 'yes'.* True, False or a function"),
    ({"merge_coincident": "no"}, ms.InvalidOption, "merge_coincident is 'no'.* True or False"),
    ({"file_pairs": 0}, ms.InvalidOption, "file_pairs is 0, it must be True or False"),
    ({"full": "yes"}, ms.InvalidOption, "full is 'yes', it must be True or False"),
    ({"periodic": [1, 2, 3]}, ms.InvalidOption, "periodic has 1 where two sides are needed"),
    ({"stay": -1}, ms.InvalidOption, "^stay is -1"),
    ({"reference": "part.vtu"}, TypeError, "'part.vtu' is a path"),
    ({"iterations": 2.5}, ms.InvalidOption, "iterations is 2.5.* whole number"),
    ({"tolerance": "small"}, ms.InvalidOption, "tolerance is 'small'"),
    ({"guard": "no"}, ms.InvalidOption, "guard is 'no'.* True or False"),
    ({"movement_limit": -1}, ms.InvalidOption, "^movement_limit is -1"),
    ({"method": ms.Laplacian(relaxation=1.7)}, ms.InvalidOption, "^relaxation is 1.7"),
    ({"method": ms.Taubin(lambda_=4)}, ms.InvalidOption, "^lambda is 4"),
    ({"backend": "gpu"}, ms.InvalidOption, "one of auto, cpu, cuda"),
    ({"timeout": [1]}, ms.InvalidOption, "timeout is .* seconds"),
    ({"fixed_types": ["brick"]}, ms.InvalidOption, "known are triangle, quad, tetra, "),
    ({"out": POINTS.tolist()}, ms.InvalidOption, "out must be a NumPy array.* list"),
    ({"element_quality": "mean_ratio"}, ms.InvalidOption, "element_quality needs full=True"),
    ({"reference": POINTS * 1j}, ms.InvalidMesh, "real numbers"),
]


@pytest.mark.parametrize(
    ("mesh", "kind", "text"), [m[1:] for m in MESHES], ids=[m[0] for m in MESHES]
)
def test_meshes_are_refused(client: ms.Client, mesh: Any, kind: type[Exception], text: str) -> None:
    with pytest.raises(kind, match=text):
        client.smooth(mesh)


@pytest.mark.parametrize(("options", "kind", "text"), OPTIONS, ids=lambda o: str(o)[:30])
def test_options_are_refused(
    client: ms.Client, options: dict[str, Any], kind: type[Exception], text: str
) -> None:
    with pytest.raises(kind, match=text):
        client.smooth((POINTS, CELLS), **options)


MOVED = POINTS + np.array([0.01, 0, 0])

TAKEN: list[tuple[str, Callable[[ms.Client], Any], Callable[[ms.Client], Any]]] = [
    (
        "rows of triangles",
        lambda c: c.smooth((POINTS[:4], [[0, 1, 2], [1, 3, 2]]))[0],
        lambda c: c.smooth((POINTS[:4], {"triangle": [[0, 1, 2], [1, 3, 2]]}))[0],
    ),
    (
        "names of cells in fixed_types",
        lambda c: c.smooth((POINTS, CELLS), fixed_types=["tetra"])[0],
        lambda c: c.smooth((POINTS, CELLS), fixed_types=["tetrahedron"])[0],
    ),
    (
        "a list of positions",
        lambda c: c.move(c.smooth((POINTS, CELLS)), to=MOVED.tolist())[0],
        lambda c: c.move(c.smooth((POINTS, CELLS)), to=MOVED)[0],
    ),
    (
        "DLPack",
        lambda c: c.smooth((Dlpack(POINTS), {"tetra": Dlpack(TETRA)}))[0],
        lambda c: c.smooth((POINTS, CELLS))[0],
    ),
    (
        "objects that are numbers",
        lambda c: c.smooth((POINTS.astype(object), CELLS))[0],
        lambda c: c.smooth((POINTS, CELLS))[0],
    ),
    (
        "VTK's arrays",
        lambda c: c.smooth(flat())[0],
        lambda c: c.smooth((POINTS, CELLS))[0],
    ),
]


@pytest.mark.parametrize(("given", "meant"), [t[1:] for t in TAKEN], ids=[t[0] for t in TAKEN])
def test_what_is_meant_is_taken(client: ms.Client, given: Any, meant: Any) -> None:
    assert np.array_equal(given(client), meant(client))


def test_images_count_their_nodes_by_coordinates(client: ms.Client) -> None:
    """VTK's voxel and pixel: hexahedron and quad, but for the order."""
    grid = np.stack(np.meshgrid(*[range(4)] * 3, indexing="ij"), -1).reshape(-1, 3).astype(float)
    low = grid[(grid < 3).all(axis=1)].astype(int)
    number = lambda *at: np.ravel_multi_index(np.transpose(low + at), (4, 4, 4))  # noqa: E731
    voxels = np.stack([number(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], axis=1)
    hexahedra = voxels[:, [0, 1, 3, 2, 4, 5, 7, 6]]
    offsets = np.arange(0, 8 * len(voxels) + 1, 8)
    mesh = (grid, (offsets, voxels.reshape(-1), np.full(len(voxels), 11, np.uint8)))
    assert client.quality(mesh).inverted_element_count == 0
    expected = client.smooth((grid, {"hexahedron": hexahedra}), boundary="free", iterations=3)
    assert np.array_equal(client.smooth(mesh, boundary="free", iterations=3)[0], expected[0])


def test_other_calls_refuse_by_name(client: ms.Client) -> None:
    mesh = client.smooth((POINTS, CELLS))
    named = ms.MeshData(
        POINTS,
        CELLS,
        point_data={"of_nodes": np.zeros(len(POINTS), int)},
        cell_data={"of_cells": np.zeros(COUNT, int)},
    )
    calls: list[tuple[Callable[[], Any], type[Exception], str]] = [
        (lambda: client.move(mesh, to="part.vtu"), TypeError, "'part.vtu' is a path"),
        (
            lambda: client.move(mesh, to=MOVED, method=ms.Move(least_step=2)),
            ms.InvalidOption,
            "^least_step is 2",
        ),
        (lambda: client.map(mesh), TypeError, "map takes many meshes; give one in a list"),
        (lambda: client.map(3), TypeError, "map takes an iterable of meshes, not 3"),
        (lambda: client.map([mesh], goal="wurst"), ms.InvalidOption, "goal is 'wurst'"),
        (lambda: client.map([mesh], gaol="worst"), TypeError, "did you mean goal="),
        (lambda: ms.smooth_many(mesh), TypeError, "smooth_many takes many meshes"),
        (lambda: client.map([mesh], max_in_flight=1.5), ms.InvalidOption, "max_in_flight is 1.5"),
        (lambda: client.session(mesh, iteration=3), TypeError, "did you mean iterations="),
        (lambda: client.session(mesh, goal="wurst"), ms.InvalidOption, "goal is 'wurst'"),
        (lambda: client.session(mesh).smooth(mesh), TypeError, "takes the positions"),
        (lambda: client.session(mesh).smooth([[0.0], [1.0, 2.0]]), ms.InvalidMesh, "positions"),
        (lambda: ms.why(mesh, 1.5), ms.InvalidOption, "cell is 1.5, it must be a whole number"),
        (lambda: ms.register_adapter(3, len, len), TypeError, "kind must be a class, it is 3"),
        (lambda: ms.register_adapter(int, 1, len), TypeError, "read must be a function, it is 1"),
        (lambda: client.smooth(named, regions="of_nodes"), ms.InvalidOption, "an array of the no"),
        (lambda: client.smooth(named, fixed="of_cells"), ms.InvalidOption, "an array of the cells"),
    ]
    for call, kind, text in calls:
        with pytest.raises(kind, match=text):
            call()


def test_wrong_addresses() -> None:
    with pytest.raises(TypeError, match=r"an address is a text .* not 50051"):
        ms.Client(50051)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"tls is an ms.Tls or True, .*Tls\(ca="):
        ms.Client("host:1", tls="ca.pem")  # type: ignore[arg-type]
    for address in ("no-such-host.invalid:50051", "http://127.0.0.1:1"):
        with ms.Client(address) as client, pytest.raises(ms.Unavailable) as caught:
            client.smooth((POINTS, CELLS), timeout=20, max_attempts=1)
        assert "while the job was under way" not in str(caught.value)
        assert "name is not known" in caught.value.hint or "check the address" in caught.value.hint


def test_attach_with_another_mesh(client: ms.Client) -> None:
    job = client.submit((POINTS, CELLS), result_ttl="10min")
    job.result(60)
    with pytest.raises(ms.InvalidMesh, match="not the mesh that was sent"):
        client.attach(job.name, cube(4)).result(60)


def test_a_callback_is_called_and_cancels_the_shortest_job(client: ms.Client) -> None:
    for _ in range(20):
        called: list[ms.Progress] = []
        with pytest.raises(ms.Cancelled):
            client.smooth((POINTS, CELLS), progress=lambda p: bool(called.append(p)))  # noqa: B023
        assert called


def test_other_adapters_may_have_no_cell_arrays(client: ms.Client) -> None:
    class Part:
        pass

    with contextlib.ExitStack() as stack:
        stack.callback(_adapters._registered.clear)
        ms.register_adapter(Part, lambda _: (POINTS, CELLS), lambda part, _: part)
        with pytest.raises(ms.InvalidOption, match="full=True"):
            client.smooth(Part(), element_quality="mean_ratio")
        result = client.smooth(Part(), element_quality="mean_ratio", full=True)
        assert result.element_quality["mean_ratio"].shape == (COUNT,)
