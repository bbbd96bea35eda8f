"""The motion solver of OpenFOAM, run by moveDynamicMesh; every step is checked by checkMesh."""

import os
import re
import shutil
import tempfile
import unittest
from pathlib import Path

import cases
import foam
from test_main import main, needs_peers

SMALL = {"along": 16, "wake": 16, "normal": 20}
PERIODIC = {"along": 12, "wake": 12, "normal": 16, "sides": "cyclic", "layers": 3, "span": 0.3}

NEAR = """actions ({ name near; type cellSet; action new; source cylinderToCell; p1 (0.5 0 -1); p2 (0.5 0 1);
radius 0.9; });"""


def setUpModule():
    if not os.environ.get("MESHSMOOTH_WITH_PEERS"):
        return
    if not shutil.which("moveDynamicMesh"):
        raise unittest.SkipTest("OpenFOAM's moveDynamicMesh is not installed")
    foam.build()


@needs_peers
class MotionSolver(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def make(self, name, motion, degrees, **options):
        folder = self.folder / name
        cases.write_case(folder, motion, degrees, **options)
        self.succeed(folder, "blockMesh")
        return folder

    def succeed(self, folder, *command):
        ended, cost = foam.run(folder, *command)
        self.assertEqual(ended.returncode, 0, ended.stdout[-2000:] + ended.stderr)
        return ended.stdout, cost

    def check_times(self, folder, count, *flags):
        times = foam.checked_times(folder, *flags)
        self.assertEqual(len(times), count + 1)
        self.assertEqual([time for time, valid in times.items() if not valid], [])

    def test_every_step_is_valid_where_displacement_laplacian_fails(self):
        ours = self.make("ours", cases.OURS, 30)
        self.succeed(ours, "moveDynamicMesh")
        self.check_times(ours, 60)
        for number, diffusivity in enumerate(("uniform", "inverseVolume", "quadratic inverseDistance (aerofoil)")):
            peer = self.make(f"peer{number}", cases.laplacian(diffusivity), 30, end=15)
            foam.run(peer, "moveDynamicMesh")
            self.assertFalse(all(foam.checked_times(peer).values()), diffusivity)

    def test_is_faster_than_displacement_laplacian(self):
        """Of the angles of which both are capable; CPU seconds beyond those of a mesh that stays."""
        def cost(name, motion):
            folder = self.make(name, motion, 5, write_interval=5)
            seconds = self.succeed(folder, "moveDynamicMesh")[1]
            self.check_times(folder, 12)
            return seconds

        rest = cost("rest", cases.REST)
        ours, peer = cost("ours", cases.OURS) - rest, cost("peer", cases.laplacian("inverseVolume")) - rest
        self.assertLess(ours, peer)

    def test_cyclic_patches_stay_matched(self):
        folder = self.make("cyclic", cases.OURS, 20, steps=20, **PERIODIC)
        self.succeed(folder, "moveDynamicMesh")
        self.check_times(folder, 20)
        text, _ = self.succeed(folder, "checkMesh", "-allGeometry", "-latestTime")
        distance = re.search(r"Coupled point location match \(average (\S+)\) OK", text)
        self.assertLess(float(distance[1]), 1e-12)
        self.assertNotEqual(foam.points(folder, 1), foam.points(folder, 5))

    def test_nodes_of_polyhedra_move(self):
        folder = self.make("polyhedra", cases.OURS, 20, steps=20, **PERIODIC)
        cases.write(folder, "system/topoSetDict", "dictionary", NEAR)
        self.succeed(folder, "topoSet")
        self.succeed(folder, "refineHexMesh", "near", "-overwrite")
        text, _ = self.succeed(folder, "checkMesh")
        self.assertGreater(int(re.search(r"polyhedra: +(\d+)", text)[1]), 100)
        self.succeed(folder, "moveDynamicMesh")
        self.check_times(folder, 20)

    def make_polygons(self, degrees):
        """A plane mesh with polygons, and with quads of which three corners lie on a line."""
        folder = self.make("polygons", cases.OURS, degrees, steps=20, **SMALL)
        cases.write(folder, "system/topoSetDict", "dictionary", NEAR)
        cases.write(folder, "system/refineMeshDict", "dictionary",
                    "set near; coordinateSystem global; globalCoeffs { tan1 (1 0 0); tan2 (0 1 0); } "
                    "directions (tan1 tan2); useHexTopology yes; geometricCut no; writeMesh no;")
        self.succeed(folder, "topoSet")
        self.succeed(folder, "refineMesh", "-overwrite")
        text, _ = self.succeed(folder, "checkMesh")
        self.assertGreater(int(re.search(r"polyhedra: +(\d+)", text)[1]), 100)
        return folder

    def test_polygons_of_a_plane_mesh_move(self):
        folder = self.make_polygons(5)
        self.succeed(folder, "moveDynamicMesh")
        self.check_times(folder, 20)

    def test_cells_that_fail_the_checks_of_openfoam_are_named(self):
        ended, _ = foam.run(self.make_polygons(20), "moveDynamicMesh")
        self.assertEqual(ended.returncode, 1)
        self.assertIn("The moved mesh fails OpenFOAM's own checks", ended.stderr)
        self.assertRegex(ended.stdout, r"(?i)face \d+|cell \d+|\d+ faces are incorrectly oriented")

    def test_a_run_continues_where_it_was_stopped(self):
        folder = self.make("restart", cases.OURS, 20, steps=20, end=5, **SMALL)
        self.succeed(folder, "moveDynamicMesh")
        control = folder / "system/controlDict"
        control.write_text(control.read_text().replace("startFrom startTime", "startFrom latestTime")
                           .replace("endTime 5", "endTime 20"))
        self.succeed(folder, "moveDynamicMesh")
        self.check_times(folder, 20)

    def fail(self, motion, *expected, degrees=5, **options):
        folder = self.make("wrong", motion, degrees, **{**SMALL, **options})
        ended, _ = foam.run(folder, "moveDynamicMesh")
        self.assertEqual(ended.returncode, 1, ended.stdout[-2000:] + ended.stderr)
        self.assertIn("FOAM FATAL ERROR", ended.stderr)
        for text in expected:
            self.assertIn(text, ended.stderr)

    def test_an_absent_server_is_named_with_a_hint(self):
        self.fail(cases.OURS + 'server "unix:/nowhere/socket"; timeout 0.5;', "unix:/nowhere/socket", "start one with")

    def test_an_absent_program_is_named(self):
        folder = self.make("absent", cases.OURS, 5, **SMALL)
        ended, _ = foam.run(folder, "moveDynamicMesh", MESHSMOOTH_SERVER_BINARY="/nowhere/program")
        self.assertEqual(ended.returncode, 1)
        self.assertIn("cannot run /nowhere/program: No such file or directory", ended.stderr)
        self.assertIn("$MESHSMOOTH_SERVER", ended.stderr)

    def test_a_step_that_cannot_be_made_is_refused(self):
        self.fail(cases.OURS, "of the step can be made with valid elements", "leastShare", degrees=180, steps=4,
                  along=6, wake=6, normal=6)


if __name__ == "__main__":
    main()
