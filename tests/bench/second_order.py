#!/usr/bin/env python3
"""Cures coarse meshes of second order beside Gmsh and writes docs/results/second-order.json.

    second_order.py [-o FILE.json]

Gmsh makes the meshes without an optimizer of its own. Then meshsmooth (`meshsmooth.gmsh.smooth`)
and Gmsh's optimizer `HighOrder` with its boundary fixed each start from them; Gmsh evaluates both
results. Gmsh's runs in a process of its own, for it aborts where it does not succeed.

Needs numpy and gmsh, and a server: $MESHSMOOTH_SERVER or $MESHSMOOTH_SERVER_BINARY.
"""

from __future__ import annotations

import argparse
import datetime
import json
import multiprocessing
import os
import platform
import subprocess
import time
from pathlib import Path

import gmsh
import numpy as np

import meshsmooth as ms

ROOT = Path(__file__).resolve().parents[2]
QUARTER = np.pi / 2


def ball(occ):
    occ.addSphere(0, 0, 0, 1)
    return 0.3


def torus(occ):
    occ.addTorus(0, 0, 0, 1, 0.35)
    return 0.25


def elbow(occ):
    occ.addDisk(0, 0, 0, 0.5, 0.5, tag=1)
    occ.addDisk(0, 0, 0, 0.4, 0.4, tag=2)
    occ.cut([(2, 1)], [(2, 2)])
    occ.revolve(occ.getEntities(2), 1, 0, 0, 0, 1, 0, QUARTER)
    return 0.15


def shell(occ):
    occ.addSphere(0, 0, 0, 1, tag=1)
    occ.addSphere(0, 0, 0, 0.93, tag=2)
    occ.cut([(3, 1)], [(3, 2)])
    return 0.25


def bracket(occ):
    occ.addBox(0, 0, 0, 3, 2, 0.4, tag=1)
    occ.addBox(0, 0, 0, 0.4, 2, 2, tag=2)
    occ.fuse([(3, 1)], [(3, 2)], tag=3)
    occ.addCylinder(2, 1, -1, 0, 0, 3, 0.4, tag=4)
    occ.addCylinder(-1, 1, 1.3, 3, 0, 0, 0.3, tag=5)
    occ.cut([(3, 3)], [(3, 4), (3, 5)], tag=6)
    return 0.25


def make(shape, coarseness):
    """Makes the mesh in a new model."""
    gmsh.clear()
    length = shape(gmsh.model.occ) * coarseness
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", length)
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0.9 * length)
    gmsh.model.mesh.generate(3)


def determinants():
    """The least Jacobian of each element, and that over its largest one."""
    tags = np.concatenate(gmsh.model.mesh.getElements(3)[1])
    least = gmsh.model.mesh.getElementQualities(tags, "minDetJac")
    return least, least / np.maximum(gmsh.model.mesh.getElementQualities(tags, "maxDetJac"), 1e-300)


def evaluate(seconds):
    least, ratio = determinants()
    return {"invalid": int((least <= 0).sum()), "ratio": float(ratio.min()), "seconds": seconds}


def by_gmsh(answer):
    begin = time.perf_counter()
    gmsh.model.mesh.optimize("HighOrder")
    answer.send(evaluate(time.perf_counter() - begin))


def measure(shape, coarseness):
    make(shape, coarseness)
    least, _ = determinants()
    before = evaluate(0)
    boundary = gmsh.model.mesh.getNodes(2, -1, True)[1]

    here, there = multiprocessing.Pipe()
    child = multiprocessing.get_context("fork").Process(target=by_gmsh, args=(there,))
    child.start()
    there.close()
    try:
        theirs = here.recv()
    except EOFError:  # it aborted
        theirs = None
    child.join()

    begin = time.perf_counter()
    summary = ms.gmsh.smooth()
    ours = evaluate(time.perf_counter() - begin)
    if (gmsh.model.mesh.getNodes(2, -1, True)[1] != boundary).any():
        raise SystemExit("a node of the boundary moved")
    if ((determinants()[0] <= 0) & (least > 0)).any():
        raise SystemExit("a valid element became invalid")
    if summary.quality_after.inverted_element_count != ours["invalid"]:
        raise SystemExit("Gmsh and meshsmooth do not agree on what is invalid")
    return [f"{shape.__name__} × {coarseness}", f"{len(least):,}", *row(before)[:2],
            *(["fails", "–", "–"] if theirs is None else row(theirs)), *row(ours)]


def row(found):
    return [str(found["invalid"]), f"{found['ratio']:.3f}".replace("-", "−"),
            f"{found['seconds']:.3f}"]


def ratios(rows):
    """Of the meshes on which Gmsh's optimizer has work: how many times as long it takes."""
    return [[mesh, elements, invalid, theirs, ours, f"{float(theirs) / float(ours):.0f}"]
            for mesh, elements, invalid, _, _, _, theirs, _, _, ours in rows
            if theirs != "–" and float(theirs) > 0.1]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--out", type=Path,
                        default=ROOT / "docs" / "results" / "second-order.json")
    arguments = parser.parse_args()
    gmsh.initialize()
    for name, value in {"General.Terminal": 0, "Mesh.ElementOrder": 2, "Mesh.HighOrderOptimize": 0,
                        "Mesh.HighOrderFixBoundaryNodes": 1}.items():
        gmsh.option.setNumber(name, value)
    make(ball, 1)
    device = ms.gmsh.smooth().execution.device_name  # the server starts
    rows = [measure(shape, coarseness)
            for shape in (ball, torus, elbow, shell, bracket)
            for coarseness in (1, 1.5, 1.8, 2.2, 3)
            if (shape, coarseness) != (shell, 3)]  # Gmsh cannot mesh it
    commit = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short=7", "HEAD"], check=True,
                            capture_output=True, text=True).stdout.strip()
    today = datetime.date.today().isoformat()
    run = {
        "title": "Meshes of second order, cured",
        "machine": ", ".join(filter(None, [
            platform.machine(), f"{len(os.sched_getaffinity(0))} cores", device,
            f"Gmsh {gmsh.__version__}"])),
        "command": "tests/bench/second_order.py",
        "date": today,
        "commit": commit,
        "recorded": {"commit": commit, "date": today},
        "notes": "Seconds are wall time: of meshsmooth the whole call with the way to its server and "
                 "back, of Gmsh `optimize(\"HighOrder\")` alone.",
        "tables": {"cure": {
            "caption": "Meshes of tetrahedron10 by Gmsh, coarser from row to row; the boundary stays. "
                       "Worst: the least Jacobian of an element over its largest.",
            "columns": ["Mesh", "Elements", "Invalid", "Worst", "Gmsh: invalid", "Worst", "s",
                        "meshsmooth: invalid", "Worst", "s"],
            "rows": rows},
            "ratios": {
                "caption": "Those on which Gmsh's optimizer works for more than 0.1 s.",
                "columns": ["Mesh", "Elements", "Invalid", "Gmsh, s", "meshsmooth, s", "Ratio"],
                "rows": ratios(rows)}},
    }
    arguments.out.write_text(json.dumps(run, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main()
