"""Meshes that `generate` makes: what it prints, what the files hold, what it refuses."""

import json
import re
from pathlib import Path

from programs import USAGE, CliTest, main

SHAPES = ["bar", "ball", "box-sphere", "cube", "damage", "flap", "hub", "layer", "mixed", "pipe",
          "slope", "square"]


class Generate(CliTest):
    def make(self, shape, *arguments, name="out.vtk"):
        """What it prints about the mesh."""
        result = self.run_cli("generate", shape, *arguments, "-o", self.path(name))
        return result.stdout.strip().removeprefix(self.path(name) + ": ")

    def inverted(self, *arguments):
        name = "q.vtk"
        self.make(*arguments, name=name)
        text = self.run_cli("quality", self.path(name)).stdout
        if "inverted 0 " in text or "no element is inverted" in text:
            return 0
        return int(re.search(r"inverted ([\d,]+)", text)[1].replace(",", ""))

    def test_prints_counts(self):
        self.assertEqual(self.make("hub", "--rows", 96), "37,248 nodes, 73,728 x triangle")
        self.assertEqual(self.make("hub", "--layers", 4), "12,000 nodes, 55,296 x tetrahedron")
        self.assertEqual(self.make("bar"), "1,225 nodes, 5,184 x tetrahedron")
        self.assertEqual(self.make("layer"), "3,549 nodes, 2,880 x hexahedron")
        self.assertEqual(self.make("layer", "--elements", "quad", "--cells", "9x7", "--core", 3),
                         "110 nodes, 90 x quad")
        self.assertEqual(self.make("damage"), "15,625 nodes, 82,944 x tetrahedron")

    def test_inverts_as_many_elements_as_the_options_say(self):
        self.assertEqual(self.inverted("hub", "--rows", 24, "--degrees", 30), 96)
        self.assertEqual(self.inverted("hub", "--degrees", 30, "--layers", 4), 1152)
        self.assertEqual(self.inverted("bar", "--degrees", 180), 72)
        self.assertEqual(self.inverted("layer", "--elements", "tet"), 0)
        for motion in (("--squeeze", 0.2), ("--bend", 120), ("--twist", 90)):
            self.assertGreater(self.inverted("cube", "--nodes", 2000, *motion), 0)

    def test_files_are_the_same_every_time(self):
        for arguments in (("hub", "--degrees", 20), ("bar", "--degrees", 90, "--sides", "given"),
                          ("layer", "--jitter", 0.3, "--core", 4, "--tangle", 0.2), ("damage",),
                          ("flap", "--tip", 0.4), ("box-sphere", "--move", 0.5)):
            with self.subTest(arguments=arguments):
                self.make(*arguments, name="a.vtk")
                self.make(*arguments, name="b.vtk")
                self.assertEqual(Path(self.path("a.vtk")).read_bytes(),
                                 Path(self.path("b.vtk")).read_bytes())

    def test_files_carry_the_nodes_to_fix(self):
        for name in ("hub.vtu", "hub.vtk", "hub.msh"):
            with self.subTest(name=name):
                self.make("hub", "--rows", 6, "--layers", 3, "--degrees", 10, name=name)
                self.run_cli("smooth", self.path(name), "-o", self.path("out.vtk"), "--boundary",
                             "slide", "--fixed-set", "fixed", "--report", self.path("r.json"))
                report = json.loads(Path(self.path("r.json")).read_text())
                self.assertGreaterEqual(int(self.find(report, "fixed")), 4 * 2 * 24)

    def find(self, tree, key):
        """The first number of this name in a report."""
        for name, value in tree.items():
            if name == key and not isinstance(value, dict):
                return value
            if isinstance(value, dict) and (found := self.find(value, key)) is not None:
                return found
        return None

    def test_every_shape_explains_its_own_options(self):
        listed = self.run_cli("generate", "--help").stdout
        for shape in SHAPES:
            self.assertRegex(listed, rf"(?m)^  {shape} ")
            self.assertIn("--output", self.run_cli("generate", shape, "--help").stdout)
        hub = self.run_cli("generate", "hub", "--help").stdout
        # The default as CLI11 2.3 or 2.4 shows it.
        for flag, default in (("--rows INT", 24), ("--degrees FLOAT", 0), ("--layers INT", 0)):
            self.assertRegex(hub, rf"{flag}(={default}| \[{default}\]) ")

    def test_errors_name_the_option(self):
        for expected, arguments in (
                ("rows 0 is not in [1, 5000]", ["hub", "--rows", "0"]),
                ("degrees nan is not in", ["hub", "--degrees", "nan"]),
                ("--rows", ["hub", "--rows", "many"]),
                ("--rows", ["bar", "--rows", "3"]),
                ("--sides", ["bar", "--sides", "both"]),
                ("growth 0 is not in [0.1, 10]", ["layer", "--growth", "0"]),
                ("cells 12x12: expected three", ["layer", "--cells", "12x12"]),
                ("cells 3x4x5: expected two", ["layer", "--cells", "3x4x5", "--elements", "quad"]),
                ("cells 3xx5: expected three", ["layer", "--cells", "3xx5"]),
                ("--elements", ["layer", "--elements", "pyramid"]),
                ("tangle needs a core", ["layer", "--tangle", "0.2"]),
                ("count 99: only 1 damaged", ["damage", "--cells", "6", "--count", "99"]),
                ("squeeze 0 is not in", ["cube", "--squeeze", "0"]),
                ("--twist", ["cube", "--twist", "9", "--bend", "9"]),
                ("no shape teapot; there are cube, slope", ["teapot"])):
            with self.subTest(arguments=arguments):
                error = self.error_of("generate", *arguments, "-o", self.path("out.vtk"),
                                      exit_code=USAGE)
                self.assertIn(expected, error)
        self.assertEqual(self.files(), [])


if __name__ == "__main__":
    main()
