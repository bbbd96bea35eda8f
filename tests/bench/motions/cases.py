#!/usr/bin/env python3
"""Measures the method `move` and writes docs/results/move-cases.json.

    cases.py MESHSMOOTH [--only TABLE …] [-o FILE.json]

The worst element is also measured against the reference, which is the target of `move`. Its optimum
is what `move` reaches with a tolerance of 1e-9.

Needs numpy, scipy, meshio and gmsh, MESHSMOOTH with VTK and Gmsh, and a server:
$MESHSMOOTH_SERVER or $MESHSMOOTH_SERVER_BINARY. Gmsh's mesh of the aerofoil differs a little from
run to run.
"""

from __future__ import annotations

import argparse
import datetime
import json
import platform
import subprocess
import sys
from pathlib import Path

import meshes
import numpy as np

import meshsmooth as ms

ROOT = Path(__file__).resolve().parents[3]
LONG = {"tolerance": 1e-9, "iterations": 20_000}


def worst_of_reference(result):
    """Of the elements that could change, after the last sweep."""
    return result.summary.convergence.worst_mean_ratios[-1]


def optimum(reference, there, **options):
    """The worst element against the reference, of a descent to its end."""
    return worst_of_reference(ms.move(reference.mesh, to=there, **options, full=True, history=True,
                                      **LONG))


def percent(value):
    return f"{100 * value:.1f} %"


def motion_cells(result):
    """Reached, steps, sweeps, inverted, worst mean ratio."""
    summary = result.summary
    motion = summary.motion
    steps = str(motion.step_count)
    if motion.rejected_step_count:
        steps += f" ({motion.rejected_step_count})"
    quality = summary.quality_after
    inverted = quality.inverted_element_count + quality.degenerate_element_count
    return [f"{motion.reached:.4g}", steps, str(summary.convergence.iteration_count),
            str(inverted), f"{quality.metric('mean_ratio').min:.3f}"]


MOTION = ["Reached", "Steps", "Sweeps", "Inverted", "Worst mean ratio"]


def measured(name, reference, there, *, compare=True, prescribed=None):
    """A row of a case; `prescribed` alone where the rest of the boundary slides."""
    options = {} if prescribed is None else {"prescribed": prescribed, "boundary": "slide"}
    result = ms.move(reference.mesh, to=there, full=True, history=True, **options)
    row = [name, f"{len(reference.points):,}", *motion_cells(result)]
    if compare:
        found = worst_of_reference(result)
        best = optimum(reference, there, **options)
        row += [f"{found:.3f}", f"{best:.3f}", percent(found / best - 1)]
    return row


# --- tables --------------------------------------------------------------------------------------


def hubs(program, layers=0):
    for count in (24, 48, 96):
        reference = meshes.generated(program, "hub", "--rows", count, "--layers", layers)
        radius = np.hypot(*reference.points[:, :2].T)
        cylinders = np.flatnonzero((radius < 0.4001) | (radius > 0.9999))
        for degrees in (30, 60, 90):
            there = meshes.turned_hub(reference.points, degrees)
            yield measured(f"hub of {count} rows by {degrees}°", reference, there,
                           prescribed=cylinders if layers else None)


def hubs_3d(program):
    yield from hubs(program, layers=4)


def far(program):
    reference = meshes.generated(program, "hub", "--rows", 24)
    for degrees in (120, 130, 150, 180, 270, 330, 360):
        yield measured(f"hub of 24 rows by {degrees}°", reference,
                       meshes.turned_hub(reference.points, degrees), compare=False)
    reference = meshes.generated(program, "hub", "--rows", 12, "--layers", 12)
    for degrees in (120, 180, 360):
        yield measured(f"hub of 12 rows, 3-D, by {degrees}°, ends shear", reference,
                       meshes.turned_hub(reference.points, degrees), compare=False)


def obstacles(program):
    for name, shape, flag in [("flap to {} % of the free height", "flap", "--tip"),
                              ("sphere across {} % of the gap", "box-sphere", "--move")]:
        reference = meshes.generated(program, shape)
        for share in (0.4, 0.6, 0.8):
            there = meshes.generated(program, shape, flag, share).points
            yield measured(name.format(int(100 * share)), reference, there)
    cubes = [("tetrahedra", ["cube", "--nodes", 3000]), ("all volume elements", ["mixed", "--nodes",
                                                                              3000])]
    for name, options in cubes:
        reference = meshes.generated(program, *options)
        reference.points, _ = ms.smooth(reference.mesh)
        there = meshes.twisted_cube(reference.points, 90)
        yield measured(f"{name}, cube twisted by 90°", reference, there)


def layer_heights(reference, wall, moved, degrees):
    """Of the first layer, as shares of what they were: along the turned edges off the wall."""
    pairs = meshes.edges(reference.cells)
    on_wall = np.isin(pairs, wall)
    pairs = np.where(on_wall[:, :1], pairs, pairs[:, ::-1])[on_wall.sum(axis=1) == 1]
    away = reference.points[pairs[:, 1]] - reference.points[pairs[:, 0]]
    lengths = np.linalg.norm(away, axis=1)
    straight = abs(lengths / meshes.FIRST_LAYER - 1) < 0.02  # no diagonals
    pairs, away = pairs[straight], away[straight] / lengths[straight, None]
    now = moved[pairs[:, 1]] - moved[pairs[:, 0]]
    return (now * meshes.turned(away, degrees)).sum(axis=1) / lengths[straight]


def aerofoils(_program):
    kinds = [("quads and triangles", {}), ("triangles", {"quads": False}),
             ("hexahedra and wedges, ends slide", {"span_layers": 3})]
    for kind, options in kinds:
        reference = meshes.aerofoil(**options)
        points = reference.points
        radius = np.hypot(points[:, 0] - 0.5, points[:, 1])
        outer = np.flatnonzero(radius > 4.9999)
        wall = reference.wall
        prescribed = np.union1d(wall, outer)
        slides = {"boundary": "slide"} if "span_layers" in options else {}
        for degrees in (5, 20, 40, 60):
            for tolerance in (None, 1e-8):
                there = points.copy()
                there[wall] = meshes.turned(points[wall], -degrees, (0.25, 0))
                tight = {} if tolerance is None else {"tolerance": tolerance}
                result = ms.move(reference.mesh, to=there, prescribed=prescribed, full=True,
                                 **slides, **tight)
                heights = layer_heights(reference, wall, result.points, -degrees)
                yield [f"aerofoil of {kind}, pitched by {degrees}°", f"{len(points):,}",
                             "default" if tolerance is None else "10⁻⁸",
                             *motion_cells(result)[:4], f"{heights.min():.3f}",
                             f"{heights.max():.3f}", percent((abs(heights - 1) > 0.05).mean())]


def layers(program):
    for kind, flag in (("hexahedra", "hex"), ("wedges", "wedge"), ("tetrahedra", "tet")):
        reference = meshes.generated(program, "layer", "--elements", flag)
        there = reference.points.copy()
        hill = 0.1 * np.sin(np.pi * there[:, 0])
        there[:, 2] += hill
        result = ms.move(reference.mesh, to=there, full=True)
        points = reference.points
        inside = (abs(points[:, 2] - 0.001) < 1e-5) & ((points[:, :2] % 1) != 0).all(axis=1)
        moved = result.points[inside]
        heights = (moved[:, 2] - 0.1 * np.sin(np.pi * moved[:, 0])) / 0.001
        yield [f"{kind}, the wall swells by 100 first layers", f"{len(points):,}",
                     *motion_cells(result)[:4], f"{heights.min():.3f}", f"{heights.max():.3f}"]


def cycle(program):
    for count in (24, 48):
        reference = meshes.generated(program, "hub", "--rows", count)
        boundary = reference.boundary
        size = np.full(len(reference.points), np.inf)
        pairs = meshes.edges(reference.cells)
        lengths = np.linalg.norm(np.diff(reference.points[pairs], axis=1)[:, 0], axis=1)
        for side in pairs.T:
            np.minimum.at(size, side, lengths)
        least, by_angle = np.inf, {}
        with ms.default_client().session(reference.mesh) as session:
            for step in range(1, 61):
                degrees = round(30 * np.sin(2 * np.pi * step / 60), 9) + 0.0
                there = meshes.turned_hub(reference.points, degrees)
                result = session.move(boundary, there[boundary], full=True)
                if degrees not in by_angle:
                    tight = ms.move(reference.mesh, to=there, full=True, **LONG)
                    by_angle[degrees] = tight.summary.quality_after.metric("mean_ratio").min
                found = result.summary.quality_after.metric("mean_ratio").min
                least = min(least, found / by_angle[degrees])
        drift = np.linalg.norm(result.points - reference.points, axis=1) / size
        yield [f"hub of {count} rows", "60", f"{drift.max():.1e}", percent(least - 1)]


COMPARED = ["Motion", "Nodes", *MOTION, "Of the reference", "Optimum", "Against it"]
HEIGHTS = [*MOTION[:4], "Least height", "Largest"]
# By name: the rows, the caption and the columns.
TABLES = {
    "hubs": (hubs, "Hubs in the plane; steps tried in vain in brackets.", COMPARED),
    "hubs_3d": (hubs_3d, "Hubs of four layers of tetrahedra whose ends slide.", COMPARED),
    "far": (far, "Motions up to a full turn. Nodes move on straight lines: half a turn passes "
            "through a point, more is less the other way, a full one ends where it began.",
            ["Motion", "Nodes", *MOTION]),
    "obstacles": (obstacles, "Obstacles and cubes.", COMPARED),
    "aerofoils": (aerofoils, "NACA 0012 with 20 layers, the first 10⁻⁴ chords high (Gmsh), growth "
                  "1.2; the first layer's height as a share of the reference's.",
                  ["Motion", "Nodes", "Tolerance", *HEIGHTS, "Off by > 5 %"]),
    "layers": (layers, "A layer on a plane wall, the first 0.001 high; its height as a share.",
               ["Motion", "Nodes", *HEIGHTS]),
    "cycle": (cycle, "A cycle of ±30°.",
              ["Mesh", "Steps", "Largest distance from the reference at the end, in local edge "
               "lengths", "Worst element against the optimum, at the worst step"]),
}


def git(*arguments):
    return subprocess.run(["git", "-C", ROOT, *arguments], check=True, capture_output=True,
                          text=True).stdout.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--only", nargs="+", choices=TABLES, default=list(TABLES))
    parser.add_argument("-o", "--output", type=Path,
                        default=ROOT / "docs" / "results" / "move-cases.json")
    arguments = parser.parse_args()
    commit, today = git("rev-parse", "--short", "HEAD"), str(datetime.date.today())
    run = {
        "title": "Motions and how far they are from the optimum",
        "machine": f"2 cores of a server ({platform.machine()}), CPU backend, beside other work",
        "command": "tests/bench/motions/cases.py MESHSMOOTH",
        "date": today, "commit": commit, "recorded": {"commit": commit, "date": today},
        "notes": "The whole boundary is prescribed unless its ends slide; defaults otherwise. The "
                 "worst mean ratio is that of the report, against ideal elements; the next two are "
                 "against the reference, the target, the optimum after a descent with a tolerance "
                 "of 10⁻⁹.",
        "tables": {},
    }
    if arguments.output.exists():
        run["tables"] = json.loads(arguments.output.read_text())["tables"]
    for name in arguments.only:
        find_rows, caption, columns = TABLES[name]
        rows = []
        run["tables"][name] = {"caption": caption, "columns": columns, "rows": rows}
        run["tables"] = {key: run["tables"][key] for key in TABLES if key in run["tables"]}
        for row in find_rows(arguments.program):
            print(row, flush=True)
            rows.append(row)
            arguments.output.write_text(json.dumps(run, indent=2, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    sys.exit(main())
