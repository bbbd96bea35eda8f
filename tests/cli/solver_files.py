"""A block of hexahedra as a deck, an SU2 mesh and an OpenFOAM case: what tests of these share."""

import json
import random
import re
from pathlib import Path

from programs import CliTest

SIDE = 5  # elements along each edge of the block


def node(x, y, z):
    return (z * (SIDE + 1) + y) * (SIDE + 1) + x


def corners(x, y, z):
    return [node(x, y, z), node(x + 1, y, z), node(x + 1, y + 1, z), node(x, y + 1, z),
            node(x, y, z + 1), node(x + 1, y, z + 1), node(x + 1, y + 1, z + 1),
            node(x, y + 1, z + 1)]


def block(amount=0.35):
    """A block of hexahedra; nodes inside are moved by up to `amount` of an edge."""
    dice = random.Random(7)
    points, steps = [], range(SIDE + 1)
    for z in steps:
        for y in steps:
            for x in steps:
                inside = all(0 < c < SIDE for c in (x, y, z))
                points.append([c + (dice.uniform(-amount, amount) if inside else 0.0)
                               for c in (x, y, z)])
    cells = [corners(x, y, z) for z in range(SIDE) for y in range(SIDE) for x in range(SIDE)]
    return points, cells


def deck():
    """Uniform tension, which elements of any shape carry exactly."""
    points, cells = block()
    lines = ["*NODE, NSET=all"]
    lines += [f"{i + 1}, " + ", ".join(f"{c:.16g}" for c in p) for i, p in enumerate(points)]
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=bar")
    lines += [f"{i + 1}, " + ", ".join(str(n + 1) for n in c) for i, c in enumerate(cells)]
    for axis, name in enumerate("xyz"):
        for side, value in (("low", 0.0), ("high", float(SIDE))):
            lines.append(f"*NSET, NSET={side}_{name}")
            lines += [f"{i + 1}," for i, p in enumerate(points) if p[axis] == value]
    lines += ["*MATERIAL, NAME=steel", "*ELASTIC", "1000., 0.3",
              "*SOLID SECTION, ELSET=bar, MATERIAL=steel", "*STEP", "*STATIC", "*BOUNDARY",
              "low_x, 1, 1", "low_y, 2, 2", "low_z, 3, 3", f"high_x, 1, 1, {0.01 * SIDE}",
              "*NODE PRINT, NSET=all", "U", "*EL PRINT, ELSET=bar", "S", "*END STEP"]
    return "\n".join(lines) + "\n"


def su2():
    points, cells = block()
    lines = ["NDIME= 3", f"NELEM= {len(cells)}"]
    lines += [f"12 {' '.join(map(str, c))} {i}" for i, c in enumerate(cells)]
    lines.append(f"NPOIN= {len(points)}")
    lines += [f"{' '.join(map(repr, p))} {i}" for i, p in enumerate(points)]
    quads = [corners(x, y, 0)[3::-1] for y in range(SIDE) for x in range(SIDE)]
    lines += ["NMARK= 1", "MARKER_TAG= low_z", f"MARKER_ELEMS= {len(quads)}"]
    lines += [f"9 {' '.join(map(str, q))}" for q in quads]
    return "\n".join(lines) + "\n"


def foam_header(type_, name):
    return f"FoamFile\n{{\n version 2.0;\n format ascii;\n class {type_};\n object {name};\n}}\n"


def write_case(folder, write_format="ascii"):
    """The block for OpenFOAM, as blockMesh makes it."""
    system = Path(folder, "system")
    system.mkdir(parents=True, exist_ok=True)
    (system / "controlDict").write_text(
        foam_header("dictionary", "controlDict") +
        "application none; startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1;\n"
        f"writeControl timeStep; writeInterval 1; writeFormat {write_format}; writePrecision 16;\n")
    schemes = ("ddt", "grad", "div", "laplacian", "interpolation", "snGrad")
    (system / "fvSchemes").write_text(
        foam_header("dictionary", "fvSchemes") + "".join(f"{name}Schemes {{}}\n" for name in schemes))
    (system / "fvSolution").write_text(foam_header("dictionary", "fvSolution"))
    s = SIDE
    (system / "blockMeshDict").write_text(
        foam_header("dictionary", "blockMeshDict") + f"""convertToMeters 1;
vertices ((0 0 0) ({s} 0 0) ({s} {s} 0) (0 {s} 0) (0 0 {s}) ({s} 0 {s}) ({s} {s} {s}) (0 {s} {s}));
blocks (hex (0 1 2 3 4 5 6 7) core ({s} {s} {s}) simpleGrading (1 1 1));
edges ();
boundary (
 inlet {{ type patch; faces ((0 4 7 3)); }}
 walls {{ type wall; faces ((1 2 6 5) (0 3 2 1) (4 5 6 7) (0 1 5 4) (3 7 6 2)); }}
);
""")


class SolverFilesTest(CliTest):
    def quality(self, path):
        """The least mean ratio of a mesh."""
        metrics = json.loads(self.run_cli("quality", path, "--json").stdout)["metrics"]
        return next(m["min"] for m in metrics if m["metric"].endswith("MEAN_RATIO"))

    def smooth(self, path, output, *flags):
        self.run_cli("smooth", path, "-o", output, *flags)
        self.assertGreater(self.quality(output), self.quality(path) + 0.1)

    def changed(self, before, after):
        """Pairs of lines that differ."""
        old, new = before.splitlines(), after.splitlines()
        self.assertEqual(len(old), len(new))
        return [(a, b) for a, b in zip(old, new) if a != b]

    def check_text(self, name, text):
        """Smoothed, only lines of nodes inside of the block differ."""
        path, output = Path(self.path(name)), Path(self.path("smooth-" + name))
        path.write_text(text)
        self.smooth(path, output)
        changed = self.changed(text, output.read_text())
        self.assertEqual(len(changed), (SIDE - 1) ** 3)
        for line, _ in changed:
            self.assertEqual(len(re.findall(r"\d\.\d{9}", line)), 3, line)
        return path, output
