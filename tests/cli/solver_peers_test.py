"""Decks, SU2 meshes and OpenFOAM cases, smoothed and given back to the programs they are for:
CalculiX, OpenFOAM and meshio."""

import importlib.util
import os
import re
import shutil
import struct
import subprocess
import unittest
from pathlib import Path

from programs import main
from solver_files import SIDE, SolverFilesTest, block, deck, foam_header, su2, write_case
from test_main import needs_peers


ALL = ("-allGeometry", "-allTopology")


def program(name):
    return unittest.skipUnless(shutil.which(name), f"{name} is not installed")


@needs_peers
class Peers(SolverFilesTest):
    def run_program(self, *command, cwd=None):
        environment = {**os.environ, "WM_PROJECT_DIR": "/usr/share/openfoam", "OMP_NUM_THREADS": "1"}
        result = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True,
                                timeout=300, check=False)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return result.stdout

    @program("ccx")
    def test_calculix_solves_the_same_problem(self):
        self.check_bar("bar.inp", deck())

    @program("ccx")
    def test_calculix_reads_the_same_leniencies(self):
        """What it tolerates in a deck is read here, too, and written so that it still does."""
        text = "a line before the first keyword\n" + deck().replace("*NODE", "* NODE ", 1)
        first_node = re.search(r"^1, .*$", text, re.M)[0]
        extra = ["*NODE", first_node, "*NSET, NSET=some", "1, 99999", "*MATERIAL"]
        text = text.replace("*MATERIAL", "\n".join(extra), 1)
        text = re.sub(r"^(1(?:, \d+){8})$", r"\1, 0, 0", text, count=1, flags=re.M)
        output = self.check_bar("lenient.inp", text)
        notes = self.run_cli("quality", output).stdout
        for what in ("before the first keyword", "is defined again", "for this set",
                     "what follows the 8 nodes of element 1"):
            self.assertIn(what, notes)

    def check_bar(self, name, text):
        path, output = self.check_text(name, text)
        for deck_path in (path, output):
            log = self.run_program("ccx", deck_path.stem, cwd=deck_path.parent)
            self.assertIn("Job finished", log)
            rows = re.findall(r"^ +\d+ +\d+ +(-?\d\.\d+E[+-]\d+) +(-?\d\.\d+E[+-]\d+) ",
                              deck_path.with_suffix(".dat").read_text(), re.M)
            self.assertEqual(len(rows), 8 * SIDE ** 3, "stresses at the integration points")
            for xx, yy in rows:
                self.assertAlmostEqual(float(xx), 10, delta=1e-4)
                self.assertAlmostEqual(float(yy), 0, delta=1e-4)
        return output

    @unittest.skipUnless(importlib.util.find_spec("meshio"), "meshio is not installed")
    def test_meshio_reads_the_same_mesh(self):
        import meshio  # only here: it may be missing
        for name, text in (("bar.inp", deck()), ("bar.su2", su2())):
            path, output = self.check_text(name, text)
            before, after = meshio.read(path), meshio.read(output)
            self.assertTrue((before.cells_dict["hexahedron"] ==
                             after.cells_dict["hexahedron"]).all())
            self.run_cli("quality", output, "-o", self.path("out.vtu"))
            ours = meshio.read(self.path("out.vtu"))
            self.assertTrue((ours.points == after.points).all(), name)
            self.assertTrue((ours.cells_dict["hexahedron"] ==
                             after.cells_dict["hexahedron"]).all(), name)

    def check_case(self, folder, *flags):
        """The average angle between faces and lines of cells; checkMesh must be content."""
        text = self.run_program("checkMesh", *flags, "-case", folder)
        self.assertIn("Mesh OK.", text)
        return float(re.search(r"non-orthogonality Max: \S+ average: (\S+)", text)[1])

    @program("blockMesh")
    @program("checkMesh")
    def test_openfoam_accepts_the_case(self):
        for write_format in ("ascii", "binary"):
            folder = Path(self.path(write_format))
            write_case(folder, write_format)
            self.run_program("blockMesh", "-case", folder)
            mesh = folder / "constant" / "polyMesh"
            files = {f.name: f.read_bytes() for f in mesh.iterdir()}
            self.assertIn(f"format      {write_format}".encode(), files["points"])
            self.give_positions(mesh / "points", files["points"], write_format)
            angle = self.check_case(folder, *ALL)
            files["points"] = (mesh / "points").read_bytes()

            other = Path(self.path("smooth-" + write_format))
            shutil.copytree(folder, other)
            shutil.rmtree(other / "constant")
            self.smooth(folder, other, "--fixed-set", "inlet")
            self.assertLess(self.check_case(other, *ALL), angle / 2)
            for name, data in files.items():
                written = (other / "constant" / "polyMesh" / name).read_bytes()
                self.assertEqual(written == data, name != "points", name)

            self.run_cli("smooth", mesh, "-o", folder, "--fixed-set", "inlet")
            self.assertEqual((mesh / "points").read_bytes(),
                             (other / "constant" / "polyMesh" / "points").read_bytes())

    def give_positions(self, path, data, write_format):
        """The positions of the block, whose nodes blockMesh numbers the same way."""
        points, _ = block(0.3)
        if write_format == "binary":
            at = re.search(rb"\n%d\s*\(" % len(points), data).end()
            body = struct.pack(f"<{3 * len(points)}d", *(c for p in points for c in p))
            path.write_bytes(data[:at] + body + data[at + len(body):])
            return
        text = data.decode()
        at = re.search(r"\n%d\s*\(" % len(points), text).end()
        rows = "\n".join("(" + " ".join(map(repr, p)) + ")" for p in points)
        path.write_text(text[:at] + "\n" + rows + "\n" + text[text.rindex(")"):])

    @program("refineHexMesh")
    @program("topoSet")
    @program("checkMesh")
    def test_openfoam_accepts_a_case_with_polyhedra(self):
        folder = Path(self.path("poly"))
        write_case(folder)
        (folder / "system" / "topoSetDict").write_text(
            foam_header("dictionary", "topoSetDict") +
            "actions ({ name core; type cellSet; action new; source boxToCell; "
            "box (0.9 0.9 0.9) (2.1 2.1 2.1); });\n")
        self.run_program("blockMesh", "-case", folder)
        self.run_program("topoSet", "-case", folder)
        self.run_program("refineHexMesh", "core", "-overwrite", "-case", folder)
        self.check_case(folder)
        points = folder / "constant" / "polyMesh" / "points"
        # The polyhedra share a face or an edge with the refined cell, from 1 to 2: their nodes are
        # below 3.5, and (3 3 3) is none of them.
        before, count = re.subn(r"\n\(4(\.0+\d)? 4(\.0+\d)? 4(\.0+\d)?\)", "\n(4.3 4.2 3.7)",
                                points.read_text())
        self.assertEqual(count, 1)
        points.write_text(before)
        angle = self.check_case(folder)
        self.run_cli("smooth", folder, "-o", folder)
        self.assertLess(self.check_case(folder), angle)
        changed = self.changed(before, points.read_text())
        self.assertIn("(4.3 4.2 3.7)", [line for line, _ in changed])
        for line, _ in changed:
            position = [round(float(c), 6) for c in line.strip("()").split()]
            self.assertTrue(max(position) > 3.5 or position == [3, 3, 3], line)


if __name__ == "__main__":
    main()
