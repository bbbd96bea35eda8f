"""Meshes of others on their surfaces, beside the results of others.

MESHSMOOTH_SURFACE_DATA names a folder with files of CMU-CBML/HexOpt (NAME.vtk, NAME.obj),
which are no part of the project; they may be compressed by xz.
"""

import json
import lzma
import os
import unittest
from pathlib import Path

from programs import CliTest, main

DATA = os.environ.get("MESHSMOOTH_SURFACE_DATA")
# Least scaled Jacobian of the authors' own results, and the options.
HEXOPT = {
    "CAD4": (0.120, []),
    "impeller": (0.430, []),
}


@unittest.skipIf(not DATA, "MESHSMOOTH_SURFACE_DATA names no folder with meshes of HexOpt")
class SurfaceDataTest(CliTest):

    def unpacked(self, name):
        plain = Path(DATA, name)
        if plain.exists():
            return plain
        target = Path(self.path(name))
        target.write_bytes(lzma.decompress(Path(DATA, name + ".xz").read_bytes()))
        return target

    def test_lies_on_the_surface_and_is_no_worse_than_theirs(self):
        for name, (least, options) in HEXOPT.items():
            with self.subTest(name):
                report = self.path("report.json")
                self.run_cli("smooth", self.unpacked(name + ".vtk"), "-o", self.path("out.vtk"),
                             "--surface", self.unpacked(name + ".obj"), "--goal", "worst",
                             "--backend", "cpu", "--report", report, *options)
                summary = json.loads(Path(report).read_text())
                after, fit = summary["quality_after"], summary["fit"]
                self.assertEqual(int(after["inverted_element_count"]), 0)
                self.assertEqual(fit["node_count"], fit["reached_count"])
                self.assertEqual(int(fit["unmatched_corner_count"]), 0)
                self.assertEqual(int(fit["unmatched_curve_count"]), 0)
                diagonal = summary["convergence"]["bounding_box_diagonal"]
                self.assertLess(fit["result_to_surface"].get("largest", 0), 1e-6 * diagonal)
                jacobian = next(m for m in after["metrics"]
                                if m["metric"] == "QUALITY_METRIC_SCALED_JACOBIAN")
                self.assertGreaterEqual(jacobian["min"], least)


if __name__ == "__main__":
    main()
