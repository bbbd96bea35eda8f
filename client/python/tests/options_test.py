"""Options travel as they were given; what is unset stays unset; the bits are the command line's."""

from __future__ import annotations

import dataclasses
import datetime
import pathlib
from typing import Any

import numpy as np
import pytest
from adapters_test import assert_same
from conftest import cube, run_cli
from meshes import Case, read_vtk_points

import meshsmooth as ms
from meshsmooth import _methods, _options

POINTS, CELLS = cube(5)
ROWS = [("tetra", tuple(map(int, row))) for row in CELLS["tetra"]]


def test_unset_stays_unset() -> None:
    assert _options.encode_options({}).SerializeToString() == b""
    message = _options.encode_options({"method": ms.Optimize()})
    assert message.WhichOneof("method") == "optimize"
    assert message.optimize.SerializeToString() == b""


CHOICES: list[tuple[ms.JobOptions, list[str]]] = [
    ({}, []),
    ({"method": ms.Optimize(goal="worst")}, ["--goal", "worst"]),
    ({"goal": "average", "stay": 0.5}, ["--goal", "average", "--stay", "0.5"]),
    ({"target": "input"}, ["--target", "input"]),
    ({"method": "laplacian"}, ["--method", "laplacian"]),
    (
        {"method": ms.Laplacian(weighting="edge-length", relaxation=0.5)},
        ["--method", "laplacian", "--weighting", "edge-length", "--relaxation", "0.5"],
    ),
    ({"method": "weighted-laplacian"}, ["--method", "weighted-laplacian"]),
    (
        {"method": ms.SmartLaplacian(weighting="ball-volume"), "form": "jacobi"},
        ["--method", "smart-laplacian", "--weighting", "ball-volume", "--form", "jacobi"],
    ),
    (
        {"method": ms.Taubin(lambda_=0.5, mu=-0.6), "guard": False},
        ["--method", "taubin", "--lambda", "0.5", "--mu", "-0.6", "--guard", "off"],
    ),
    (
        {"method": ms.HcLaplacian(alpha=0.1, beta=0.6)},
        ["--method", "hc-laplacian", "--alpha", "0.1", "--beta", "0.6"],
    ),
    (
        {"method": ms.WindowedSinc(window="hamming", pass_band=0.2)},
        ["--method", "windowed-sinc", "--window", "hamming", "--pass-band", "0.2"],
    ),
    ({"boundary": "slide", "feature_angle": 40}, ["--boundary", "slide", "--feature-angle", "40"]),
    ({"boundary": "free", "iterations": 2}, ["--boundary", "free", "--iterations", "2"]),
    ({"movement_limit": "1%"}, ["--movement-limit", "1%"]),
    ({"movement_limit": 0.02}, ["--movement-limit", "0.02"]),
    ({"target_quality": 0.4}, ["--target-quality", "0.4"]),
    ({"tolerance": 0.01}, ["--tolerance", "0.01"]),
    ({"absolute_tolerance": 0.01}, ["--absolute-tolerance", "0.01"]),
    ({"report_below": 0.5}, ["--report-below", "0.5"]),
    (
        {"only_below": 0.5, "only_below_rings": 1},
        ["--only-below", "0.5", "--only-below-rings", "1"],
    ),
    ({"tangled": "refuse", "history": True}, ["--tangled", "refuse", "--history"]),
    (
        {"method": "laplacian", "never_worse": False},
        ["--method", "laplacian", "--never-worse", "off"],
    ),
    (
        {"method": "laplacian", "metric": "scaled_jacobian"},
        ["--method", "laplacian", "--metric", "scaled-jacobian"],
    ),
    ({"fixed_types": ["tetrahedron"]}, ["--fixed-types", "tetrahedron"]),
]


@pytest.mark.parametrize(("options", "flags"), CHOICES)
def test_options_are_those_of_the_command_line(
    client: ms.Client, tmp_path: pathlib.Path, options: ms.JobOptions, flags: list[str]
) -> None:
    source, target = tmp_path / "in.vtk", tmp_path / "out.vtk"
    Case(POINTS, ROWS).write_vtk(source)
    done = run_cli("smooth", source, "-o", target, "--quiet", *flags)
    assert done.returncode == 0, done.stderr
    assert_same(client.smooth((POINTS, CELLS), **options)[0], read_vtk_points(target))


def test_methods_are_those_of_the_server(client: ms.Client) -> None:
    info = client.info().raw
    for name, defaults in zip(info["methods"], info["method_defaults"], strict=True):
        method = _methods.NAMED_METHODS[name.replace("_", "-")]
        names = {_methods.WIRE_NAMES.get(f.name, f.name) for f in dataclasses.fields(method)}
        # Of a derivative the function decides that is called.
        assert names == set(defaults[name]) - {"derivative"}
        assert method._iterations == defaults["max_iteration_count"]


def fixed_cases() -> list[Any]:
    mask = np.zeros(len(POINTS), bool)
    mask[::3] = True
    return [mask, np.flatnonzero(mask), list(map(int, np.flatnonzero(mask)))]


@pytest.mark.parametrize("fixed", fixed_cases())
def test_fixed_nodes_stay(client: ms.Client, fixed: Any) -> None:
    better, _ = client.smooth((POINTS, CELLS), fixed=fixed)
    chosen = np.asarray(fixed)
    assert (better[chosen] == POINTS[chosen]).all()
    assert (better != POINTS).any()


def test_fixed_by_the_name_of_an_array_or_set(client: ms.Client) -> None:
    values = np.zeros(len(POINTS))
    values[::3] = 1
    values[1] = np.nan  # no value
    mesh = ms.MeshData(
        POINTS,
        CELLS,
        point_data={"hold": values},
        node_sets={"odd": np.arange(len(POINTS))[1::2]},
    )
    assert_same(
        client.smooth(mesh, fixed="hold").points, client.smooth(mesh, fixed=values == 1).points
    )
    both = client.smooth(mesh, fixed=["hold", "odd"]).points
    assert (both[1::2] == POINTS[1::2]).all()
    assert (both[::3] == POINTS[::3]).all()
    with pytest.raises(ms.InvalidOption, match="'hold'") as caught:
        client.smooth(mesh, fixed="inlet")
    assert caught.value.reason == "NAME_UNKNOWN"


def test_regions_keep_their_interface(client: ms.Client) -> None:
    middle = POINTS[CELLS["tetra"]].mean(axis=1)[:, 0] > 0.5
    mesh = ms.MeshData(POINTS, CELLS, cell_data={"material": middle * 7.0})
    by_name = client.smooth(mesh, regions="material", full=True)
    assert by_name.summary.nodes.between_regions > 0
    by_array = client.smooth((POINTS, CELLS), regions=np.where(middle, 5, -3))
    assert_same(by_name.points, by_array[0])
    automatic = ms.MeshData(POINTS, CELLS, cell_data={"gmsh:physical": middle * 1})
    assert_same(client.smooth(automatic).points, by_name.points)
    assert_same(client.smooth(automatic, regions=None).points, client.smooth((POINTS, CELLS))[0])
    with pytest.raises(ms.InvalidOption) as caught:
        client.smooth(mesh, regions="material", boundary="free")
    assert caught.value.reason == "OPTION_MISPLACED"
    with pytest.raises(ms.InvalidOption) as caught:
        client.smooth((POINTS, CELLS), regions=np.linspace(0, 1, len(middle)))
    assert caught.value.reason == "ARRAY_NOT_WHOLE"


def test_reference(client: ms.Client, tmp_path: pathlib.Path) -> None:
    reference = POINTS * [1, 2, 1]
    source, target, shape = (tmp_path / name for name in ("in.vtk", "out.vtk", "shape.vtk"))
    Case(POINTS, ROWS).write_vtk(source)
    Case(reference, ROWS).write_vtk(shape)
    run_cli("smooth", source, "-o", target, "--quiet", "--reference", shape)
    expected = read_vtk_points(target)
    assert_same(client.smooth((POINTS, CELLS), reference=reference)[0], expected)
    same = client.smooth((POINTS, CELLS), reference=(reference, CELLS), target="reference")
    assert_same(same[0], expected)
    for bad in (reference[:-1], (reference, {"tetra": CELLS["tetra"][::-1]})):
        with pytest.raises(ms.InvalidMesh) as caught:
            client.smooth((POINTS, CELLS), reference=bad)
        assert caught.value.reason == "REFERENCE_DIFFERS"


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"method": "magic"}, "OPTION_OUT_OF_RANGE"),
        ({"goal": "best"}, "OPTION_OUT_OF_RANGE"),
        ({"boundary": "loose"}, "OPTION_OUT_OF_RANGE"),
        ({"movement_limit": "far"}, "OPTION_OUT_OF_RANGE"),
        ({"timeout": 0}, "OPTION_OUT_OF_RANGE"),
        ({"timeout": "soon"}, "OPTION_OUT_OF_RANGE"),
        ({"iterations": "many"}, "OPTION_OUT_OF_RANGE"),
        ({"element_quality": "beauty"}, "OPTION_OUT_OF_RANGE"),
        ({"fixed": [0.5]}, "OPTION_OUT_OF_RANGE"),
        ({"fixed": [10**6]}, "OPTION_OUT_OF_RANGE"),
        ({"fixed": np.zeros(3, bool)}, "OPTION_OUT_OF_RANGE"),
        ({"fixed": np.zeros(len(POINTS), np.uint8)}, "OPTION_OUT_OF_RANGE"),  # meant as a mask
        ({"fixed_types": ["brick"]}, "OPTION_OUT_OF_RANGE"),
        ({"out": np.zeros((2, 3))}, "OPTION_OUT_OF_RANGE"),
        ({"method": "taubin", "goal": "worst"}, "OPTION_MISPLACED"),
        ({"target": "reference"}, "OPTION_MISPLACED"),
        ({"method": "taubin", "reference": POINTS}, "OPTION_MISPLACED"),
        ({"method": "taubin", "target_quality": 0.5}, "OPTION_NOT_SUPPORTED"),  # by the server
        ({"stay": -1}, "OPTION_OUT_OF_RANGE"),  # by the server
    ],
)
def test_bad_options_are_refused_by_name(
    client: ms.Client, options: dict[str, Any], reason: str
) -> None:
    with pytest.raises(ms.InvalidOption) as caught:
        client.smooth((POINTS, CELLS), **options)
    assert caught.value.reason == reason
    assert isinstance(caught.value, ValueError)


def test_unknown_keyword_is_a_type_error(client: ms.Client) -> None:
    with pytest.raises(TypeError, match="iteratons"):
        client.smooth((POINTS, CELLS), iteratons=3)  # type: ignore[call-overload]


@pytest.mark.parametrize(
    ("given", "seconds"),
    [
        (2, 2.0),
        ("500ms", 0.5),
        ("1.5 s", 1.5),
        ("10min", 600.0),
        ("2h", 7200.0),
        (datetime.timedelta(minutes=3), 180.0),
    ],
)
def test_durations(given: Any, seconds: float) -> None:
    assert _options.to_seconds("timeout", given) == seconds
    message = _options.to_duration("timeout", given)
    assert message.seconds + message.nanos * 1e-9 == seconds
