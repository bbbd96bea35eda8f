"""The macro for FreeCAD, run in FreeCAD without a window."""

import json
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from test_main import main, needs_peers

HERE = Path(__file__).parent
CLI = os.environ["MESHSMOOTH_CLI"]
FREECAD = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")


@needs_peers
@unittest.skipUnless(FREECAD, "FreeCAD (freecadcmd) is not installed")
class Macro(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.document = Path(folder.name) / "part.FCStd"

    def run_macro(self, program=CLI):
        """The facts before and after, and all that FreeCAD printed."""
        environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "DOCUMENT": str(self.document),
                       "HOME": str(self.document.parent),
                       "MACRO": str(HERE.parents[1] / "client/freecad/meshsmooth.FCMacro"), "MESHSMOOTH_PROGRAM": program}
        ended = subprocess.run([FREECAD, HERE / "in_freecad.py"], env=environment, capture_output=True, text=True,
                               timeout=300, check=False)
        facts = [line[6:] for line in ended.stdout.splitlines() if line.startswith("FACTS ")]
        self.assertEqual(len(facts), 1, ended.stdout + ended.stderr)
        return *json.loads(facts[0]), ended.stdout + ended.stderr

    def inverted_count(self, name):
        done = subprocess.run([CLI, "quality", f"{self.document}.{name}.unv", "--json"], capture_output=True, text=True,
                              check=True)
        return int(json.loads(done.stdout)["inverted_element_count"])

    def test_untangles_and_keeps_all_else(self):
        before, after, text = self.run_macro()
        self.assertEqual(before["elements"], after["elements"])
        self.assertEqual(before["groups"], after["groups"])
        self.assertEqual(before["nodes"].keys(), after["nodes"].keys())
        self.assertNotEqual(before["nodes"], after["nodes"])
        self.assertGreater(self.inverted_count("before"), 0)
        self.assertEqual(self.inverted_count("after"), 0)
        self.assertIn("no element is inverted", text)
        deck = self.document.with_name("part-Block.inp").read_text()
        self.assertIn("C3D10", deck)

    def test_an_absent_program_is_named(self):
        before, after, text = self.run_macro("/nowhere/meshsmooth")
        self.assertEqual(before, after)
        self.assertIn("meshsmooth: the program /nowhere/meshsmooth is not found: install meshsmooth", text)


if __name__ == "__main__":
    main()
