#!/usr/bin/env python3
"""Pitches an aerofoil by OpenFOAM's moveDynamicMesh with our motion solver and with its own.

    MESHSMOOTH_SERVER=… MESHSMOOTH_C_LIBRARY=… MESHSMOOTH_FOAM_BUILD=… foam_solver.py [-o FILE.json]

Each run makes one period in 60 steps, of which checkMesh evaluates every one. Costs are CPU seconds
beyond those of a run whose mesh stays, all runs of a case one after the other.
"""

import argparse
import datetime
import json
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests/openfoam"))

import cases  # noqa: E402
import foam  # noqa: E402

SOLVERS = {
    "meshsmooth": cases.OURS,
    "uniform": cases.laplacian("uniform"),
    "inverseVolume": cases.laplacian("inverseVolume"),
    "quadratic inverseDistance": cases.laplacian("quadratic inverseDistance (aerofoil)"),
}
PLANE = {}
SPAN = {"along": 16, "wake": 16, "normal": 20, "layers": 5, "span": 0.5, "sides": "cyclic"}
CASES = [("plane, 7,200 cells", PLANE, 5), ("plane, 7,200 cells", PLANE, 30),
         ("periodic span, 9,600 cells", SPAN, 5)]


def run(motion, degrees, mesh):
    """CPU seconds, and how many steps are valid."""
    with tempfile.TemporaryDirectory() as folder:
        cases.write_case(folder, motion, degrees, **mesh)
        foam.run(folder, "blockMesh")
        ended, cost = foam.run(folder, "moveDynamicMesh")
        valid = foam.checked_times(folder)
        valid.pop(0.0)
        return cost, sum(valid.values()), ended.returncode


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs/results/foam-solver.json")
    parser.add_argument("--commit", default="")
    arguments = parser.parse_args()
    if not shutil.which("moveDynamicMesh"):
        sys.exit("moveDynamicMesh is not installed")
    foam.build()
    rows = []
    for name, mesh, degrees in CASES:
        rest, _, _ = run(cases.REST, degrees, mesh)
        for solver, motion in SOLVERS.items():
            cost, valid, code = run(motion, degrees, mesh)
            whole = code == 0 and valid == 60
            rows.append([name, f"±{degrees}°", solver, str(valid), f"{max(cost - rest, 0):.1f}" if whole else None])
            print(*rows[-1], flush=True)
    date = datetime.date.today().isoformat()
    result = {
        "title": "A pitching aerofoil in OpenFOAM",
        "machine": "2 cores of a server that others use too, CPU backend",
        "command": "tests/bench/motions/foam_solver.py",
        "date": date,
        "commit": arguments.commit or None,
        "recorded": {"commit": arguments.commit, "date": date},
        "notes": "OpenFOAM 1912 of Debian 12, GAMG with a tolerance of 1e-8 as in the tutorials of moveDynamicMesh. "
                 "With inverseDistance it stops after one iteration: the coefficients at the wall, whose distance is 0, "
                 "make every residual small.",
        "tables": {"pitch": {
            "caption": "One period of the pitch in 60 steps: how many of these checkMesh accepts, and the CPU seconds "
                       "of the whole motion, with our server's, beyond those of a mesh that stays, where it accepts all.",
            "columns": ["Mesh", "Pitch", "Solver, or diffusivity of displacementLaplacian", "Valid steps", "CPU s"],
            "rows": rows}},
    }
    arguments.output.write_text(json.dumps(result, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
