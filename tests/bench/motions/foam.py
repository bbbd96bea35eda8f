"""OpenFOAM's mesh motion on tetrahedra, for peers.py."""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np

SYSTEM = {
    "controlDict": """application moveMesh; startFrom startTime; startTime 0; stopAt endTime;
endTime 1; deltaT 1;
writeControl timeStep; writeInterval 1; writeFormat ascii; writePrecision 17;""",
    "fvSchemes": """ddtSchemes { default steadyState; } gradSchemes { default Gauss linear; }
divSchemes { default Gauss linear; } laplacianSchemes { default Gauss linear corrected; }
interpolationSchemes { default linear; } snGradSchemes { default corrected; }""",
    "fvSolution": """solvers { "cellDisplacement.*" { solver GAMG; smoother GaussSeidel;
tolerance 1e-12; relTol 1e-6; } }""",
}
MOTION = """dynamicFvMesh dynamicMotionSolverFvMesh; motionSolverLibs (fvMotionSolvers);
solver displacementLaplacian; displacementLaplacianCoeffs { diffusivity uniform; }"""


def _write(path, kind, content, name=None):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("FoamFile { version 2.0; format ascii; class %s; object %s; }\n%s\n"
                    % (kind, name or path.name, content))


def _vectors(values):
    return f"{len(values)}\n(\n" + "\n".join(
        "(%.17g %.17g %.17g)" % tuple(v) for v in values) + "\n)"


def write_mesh(folder, points, tets):
    """polyMesh: inner faces in upper triangular order, then those of the one patch, "outer"."""
    # Seen from inside the cell each face turns right, so its normal points out of it.
    faces = np.concatenate([tets[:, list(f)] for f in [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]])
    owner = np.tile(np.arange(len(tets)), 4)
    order = np.lexsort((owner, *np.sort(faces, axis=1).T))
    faces, owner, keys = faces[order], owner[order], np.sort(faces, axis=1)[order]
    twin = (keys[:-1] == keys[1:]).all(axis=1)
    first = np.flatnonzero(twin)
    alone = np.ones(len(faces), bool)
    alone[first] = alone[first + 1] = False
    upper = np.lexsort((owner[first + 1], owner[first]))
    first = first[upper]
    outer = np.flatnonzero(alone)
    outer = outer[np.argsort(owner[outer], kind="stable")]
    chosen = np.concatenate([first, outer])
    mesh = folder / "constant" / "polyMesh"
    _write(mesh / "points", "vectorField", _vectors(points))
    _write(mesh / "faces", "faceList", f"{len(chosen)}\n(\n" + "\n".join(
        "3(%d %d %d)" % tuple(face) for face in faces[chosen]) + "\n)")
    for name, labels in [("owner", owner[chosen]), ("neighbour", owner[first + 1])]:
        lines = "\n".join(map(str, labels))
        _write(mesh / name, "labelList", f"{len(labels)}\n(\n{lines}\n)")
    _write(mesh / "boundary", "polyBoundaryMesh",
           "1 ( outer { type patch; nFaces %d; startFace %d; } )" % (len(outer), len(first)))
    _, at = np.unique(faces[outer].ravel(), return_index=True)
    return faces[outer].ravel()[np.sort(at)]  # the patch's points, in its own order


def move_mesh(points, tets, boundary, there):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        patch = write_mesh(folder, points, tets)
        displacement = np.zeros_like(points)
        displacement[boundary] = there - points[boundary]
        for key, content in SYSTEM.items():
            _write(folder / "system" / key, "dictionary", content)
        _write(folder / "constant" / "dynamicMeshDict", "dictionary", MOTION)
        _write(folder / "0" / "pointDisplacement", "pointVectorField",
               "dimensions [0 1 0 0 0 0 0]; internalField uniform (0 0 0); boundaryField { outer { "
               "type fixedValue; value nonuniform List<vector> " + _vectors(displacement[patch])
               + "; } }")
        environment = {"WM_PROJECT_DIR": "/usr/share/openfoam"} | os.environ
        ended = subprocess.run(["moveMesh"], cwd=folder, env=environment, capture_output=True,
                               text=True, check=False)
        if ended.returncode != 0:
            raise RuntimeError("moveMesh: " + (ended.stderr or ended.stdout).strip()[-300:])
        text = (folder / "1" / "polyMesh" / "points").read_text()
        body = text[text.index("\n(\n") + 3:text.rindex("\n)")]
        return np.array([line.strip("()").split() for line in body.split("\n")], float)
