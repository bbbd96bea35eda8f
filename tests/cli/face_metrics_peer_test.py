"""Non-orthogonality and skewness of faces against OpenFOAM's checkMesh (Debian's openfoam)."""

import json
import os
import random
import re
import shutil
import subprocess
import unittest
from pathlib import Path

from programs import CliTest, main, vtk_text
from test_main import needs_peers

SHARE = "/usr/share/openfoam"
# Facets, seen from outside counter-clockwise, by VTK's cell type.
FACETS = {
    10: [(0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)],
    12: [(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)],
    13: [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)],
    14: [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
}
HEADER = "FoamFile {{ version 2.0; format ascii; class {}; object {}; }}\n"
SCHEMES = "".join(f"{name} {{ default none; }}\n" for name in (
    "ddtSchemes", "gradSchemes", "divSchemes", "laplacianSchemes", "interpolationSchemes",
    "snGradSchemes"))
CONTROL = ("application checkMesh; startFrom startTime; startTime 0; stopAt endTime; endTime 1;"
           " deltaT 1; writeControl timeStep; writeInterval 1; writePrecision 12;")


def lattice(split, n=5, noise=0.25):
    """A cube of n^3 boxes, inner nodes moved at random, each box split into cells."""
    randoms = random.Random(4)
    points, cells = [], []
    for k in range(n + 1):
        for j in range(n + 1):
            for i in range(n + 1):
                points.append(tuple(c + randoms.uniform(-noise, noise) if 0 < c < n else c
                                    for c in (i, j, k)))
    for k in range(n):
        for j in range(n):
            for i in range(n):
                corners = [((k + z) * (n + 1) + j + y) * (n + 1) + i + x for x, y, z in (
                    (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
                    (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))]
                cells += split(corners, points)
    return points, cells


def pyramids(corners, points):
    points.append(tuple(sum(points[c][axis] for c in corners) / 8 for axis in range(3)))
    return [(14, [*(corners[n] for n in reversed(facet)), len(points) - 1])
            for facet in FACETS[12]]


SPLITS = {
    "hexahedra": lambda c, _: [(12, c)],
    "wedges": lambda c, _: [(13, [c[n] for n in wedge])
                            for wedge in ((0, 2, 1, 4, 6, 5), (0, 3, 2, 4, 7, 6))],
    "tetrahedra": lambda c, _: [(10, [c[n] for n in tet]) for tet in (
        (0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))],
    "pyramids": pyramids,
}


def write_case(folder, points, cells):
    """The mesh as OpenFOAM's polyMesh, with what checkMesh reads beside it."""
    faces, sides = {}, []
    for cell, (kind, nodes) in enumerate(cells):
        for facet in FACETS[kind]:
            face = [nodes[n] for n in facet]
            faces.setdefault(tuple(sorted(face)), []).append((cell, face))
    for shared in faces.values():
        (owner, face), *others = shared
        sides.append((owner, others[0][0] if others else -1, face))
    inner = sorted(side for side in sides if side[1] >= 0)
    outer = sorted(side for side in sides if side[1] < 0)
    ordered = inner + outer

    def listed(name, kind, rows):
        text = HEADER.format(kind, name) + f"{len(rows)}\n(\n" + "\n".join(rows) + "\n)\n"
        (mesh / name).write_text(text)
    mesh = folder / "constant" / "polyMesh"
    mesh.mkdir(parents=True)
    listed("points", "vectorField", [f"({x!r} {y!r} {z!r})" for x, y, z in points])
    listed("faces", "faceList", [f"{len(f)}({' '.join(map(str, f))})" for _, _, f in ordered])
    listed("owner", "labelList", [str(owner) for owner, _, _ in ordered])
    listed("neighbour", "labelList", [str(other) for _, other, _ in inner])
    listed("boundary", "polyBoundaryMesh",
           [f"walls {{ type wall; nFaces {len(outer)}; startFace {len(inner)}; }}"])
    (folder / "system").mkdir()
    for name, text in (("controlDict", CONTROL), ("fvSchemes", SCHEMES), ("fvSolution", "")):
        (folder / "system" / name).write_text(HEADER.format("dictionary", name) + text)
    return len(inner)


@needs_peers
@unittest.skipUnless(shutil.which("checkMesh"), "checkMesh is not installed (apt-get install openfoam)")
class FaceMetrics(CliTest):
    def test_are_those_of_checkmesh(self):
        for name, split in SPLITS.items():
            with self.subTest(name):
                points, cells = lattice(split)
                case = self.folder / name
                internal = write_case(case, points, cells)
                text = vtk_text(points, [nodes for _, nodes in cells], cells[0][0])
                Path(self.path(name + ".vtk")).write_text(text)
                log = subprocess.run(
                    ["checkMesh", "-case", str(case)], capture_output=True, text=True, timeout=300,
                    env=dict(os.environ, WM_PROJECT_DIR=SHARE)).stdout
                angles = re.search(r"non-orthogonality Max: (\S+) average: (\S+)", log)
                skewness = re.search(r"[Mm]ax skewness = ([\d.e+-]+)", log)
                self.assertTrue(angles and skewness, log)

                ours = json.loads(self.run_cli("quality", self.path(name + ".vtk"), "--json",
                                               "--metrics", "non_orthogonality,skewness").stdout)

                faces = ours["faces"]
                self.assertEqual(faces["internal_face_count"], internal)
                print(name, angles.groups(), skewness.groups(), faces)
                for value, theirs in ((faces["max_non_orthogonality"], angles[1]),
                                      (faces["average_non_orthogonality"], angles[2]),
                                      (faces["max_skewness"], skewness[1].rstrip(",."))):
                    self.assertAlmostEqual(value, float(theirs), delta=1e-9 * float(theirs))


if __name__ == "__main__":
    main()
