"""Requirements on the quality of a mesh, and the files with the metrics of each element."""

import ast
import csv
import json
import math
import os
import re
import struct
import subprocess
import zipfile
from pathlib import Path

from programs import CLI, USAGE, CliTest, main, vtk_text

INCOMPLETE = 6
ROOT = Path(__file__).resolve().parents[2]
TYPES = {"<f8": "d", "<i8": "q", "|u1": "B"}


def read_npz(path):
    """The arrays of a .npz file, flat, and their shapes."""
    arrays = {}
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        for info in archive.infolist():
            assert info.compress_type == zipfile.ZIP_STORED
            data = archive.read(info)
            assert data[:8] == b"\x93NUMPY\x01\x00"
            size, = struct.unpack("<H", data[8:10])
            assert (10 + size) % 64 == 0
            header = ast.literal_eval(data[10:10 + size].decode())
            assert not header["fortran_order"]
            count = math.prod(header["shape"])
            values = struct.unpack(f"<{count}{TYPES[header['descr']]}", data[10 + size:])
            arrays[info.filename.removesuffix(".npy")] = (values, header["shape"])
    return arrays


def read_csv(path):
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


class Requirements(CliTest):
    def write_mesh(self, name, sliver=True):
        """Three separate tetrahedra; number 1 is flat if asked for."""
        points, cells = [], []
        for n, height in enumerate((0.8, 0.001 if sliver else 0.8, 0.8)):
            cells.append([len(points) + corner for corner in range(4)])
            points += [(3 * n, 0, 0), (3 * n + 1, 0, 0), (3 * n, 1, 0), (3 * n + 0.5, 0.5, height)]
        Path(self.path(name)).write_text(vtk_text(points, cells))
        return self.path(name)

    def not_met(self, *arguments):
        result = self.run_cli("quality", *arguments, exit_code=INCOMPLETE)
        self.assertRegex(result.stderr, r"meshsmooth: \d of \d requirements not met")
        return result

    def test_the_makefile_of_the_tutorial_fails_on_one_sliver(self):
        text = (ROOT / "docs" / "tutorial.md").read_text()
        makefile = re.search(r"```makefile\n(.*?)```", text, re.DOTALL)[1]
        Path(self.path("Makefile")).write_text(makefile)
        environment = dict(os.environ, PATH=f"{Path(CLI).resolve().parent}:{os.environ['PATH']}")
        self.write_mesh("part.vtk", sliver=False)

        def make():
            return subprocess.run(["make", "solve"], cwd=self.folder, env=environment, text=True,
                                  capture_output=True, timeout=120)
        good = make()
        self.assertEqual(good.returncode, 0, good.stderr)
        self.assertIn("met      min scaled_jacobian >=", good.stdout)
        self.write_mesh("part.vtk")
        # Newer than what was made of the mesh before, whatever the clock's resolution.
        later = max(file.stat().st_mtime for file in self.folder.iterdir()) + 10
        os.utime(self.path("part.vtk"), (later, later))

        bad = make()

        self.assertNotEqual(bad.returncode, 0)
        self.assertRegex(bad.stdout, r"NOT MET  min scaled_jacobian >= \S+: 0\.00\d+, 1 of 3 elem")
        self.assertRegex(bad.stdout, r"element 1 \(tetrahedron\) at \(3\.375, 0\.375, 0\.00025\): "
                                     r"scaled_jacobian 0\.00\d+")
        self.assertIn("Error 6", bad.stderr)

    def test_statistics_are_those_of_the_elements(self):
        mesh = self.generate("in.vtu")
        self.run_cli("quality", mesh, "--csv", self.path("q.csv"), "--metrics", "all")
        rows = read_csv(self.path("q.csv"))
        for metric in ("scaled_jacobian", "aspect_ratio", "non_orthogonality"):
            values = sorted(float(row[metric]) for row in rows if row[metric])
            for statistic, value in (("min", values[0]), ("max", values[-1]),
                                     ("percentile_5", values[len(values) * 5 // 100]),
                                     ("percentile_99", values[len(values) * 99 // 100]),
                                     ("mean", math.fsum(values) / len(values))):
                slack = 1e-9 * max(1, abs(value))
                self.run_cli("quality", mesh,
                             "--require", f"{statistic} {metric} >= {value - slack!r}",
                             "--require", f"{statistic} {metric}<={value + slack!r}")
                self.not_met(mesh, "--require", f"{statistic} {metric} > {value + slack!r}")
        self.run_cli("quality", mesh, "--require", f"elements == {len(rows)}",
                     "--require", "inverted == 0", "--require", "degenerate <= 0",
                     "--require", "aspect_ratio >= 1")

    def test_each_requirement_is_reported_and_its_elements_are_worst_first(self):
        mesh = self.generate("in.vtu", tangle=0.1)
        rows = read_csv(self.write_csv(mesh))
        inverted = [row for row in rows if row["state"] == "inverted"]
        result = self.not_met(mesh, "--require", "inverted == 0", "--require", "max edge_ratio < 2",
                              "--require", "min mean_ratio > -2")
        self.assertIn(f"NOT MET  inverted == 0: {len(inverted)}, {len(inverted):,} of "
                      f"{len(rows):,} elements", result.stdout)
        self.assertIn("met      min mean_ratio > -2: -", result.stdout)
        self.assertIn("2 of 3 requirements", result.stderr)
        worst = sorted((float(row["edge_ratio"]) for row in rows), reverse=True)[:10]
        self.assertEqual(re.findall(r"edge_ratio (\d\S+)$", result.stdout, re.M),
                         [f"{value:.6g}" for value in worst])
        ids = re.findall(r"element (\d+) .*mean_ratio", result.stdout)
        lowest = sorted(inverted, key=lambda row: (float(row["mean_ratio"]), int(row["id"])))
        self.assertEqual(ids, [row["id"] for row in lowest[:10]])

    def write_csv(self, mesh):
        self.run_cli("quality", mesh, "--metrics", "edge_ratio", "--csv", self.path("q.csv"))
        return self.path("q.csv")

    def test_mistakes_show_the_place_and_what_is_known(self):
        mesh = self.write_mesh("in.vtk")
        for text, column, expected in (
                ("min beauty > 1", 5, "no metric is called .beauty.; metrics are mean_ratio, .*skew"),
                ("least mean_ratio > 1", 1, "no metric .*counts are inverted.*statistics are min"),
                ("min mean_ratio => 1", 16, "expected one of >=, <="),
                ("min mean_ratio", 15, "expected one of >="),
                ("min mean_ratio > big", 18, "expected a number"),
                ("min mean_ratio > nan", 18, "expected a number"),
                ("inverted == 0 0", 15, "expected nothing after the number"),
                ("percentile_0 mean_ratio > 1", 1, "percentile_1 to percentile_99"),
                ("min inverted == 0", 5, "no metric is called .inverted."),
                ("", 1, "expected a metric")):
            error = self.error_of("quality", mesh, "--require", text, exit_code=USAGE)
            self.assertRegex(error, f"--require .*column {column}\\b.*{expected}")
        error = self.error_of("quality", mesh, "--metrics", "beauty", exit_code=USAGE)
        self.assertRegex(error, "--metrics.*beauty")

    def test_a_metric_that_no_element_has_is_an_error(self):
        mesh = self.write_mesh("in.vtk")
        for metric in ("min_angle", "non_orthogonality"):
            error = self.error_of("quality", mesh, "--require", f"max {metric} < 70",
                                  exit_code=USAGE)
            self.assertRegex(error, f"no element of the mesh has the metric {metric} "
                                    r"\(METRIC_UNDEFINED\)")

    def test_files_of_elements_agree(self):
        mesh = self.generate("in.vtu", shape="mixed", nodes=600)
        self.run_cli("quality", mesh, "--metrics", "all", "--csv", self.path("q.csv"), "--npz",
                     self.path("q.npz"), "--elements-json", self.path("q.json"))
        rows, arrays = read_csv(self.path("q.csv")), read_npz(self.path("q.npz"))
        columns = json.loads(Path(self.path("q.json")).read_text())
        self.assertEqual(list(columns), list(rows[0]))
        self.assertGreater(len({row["type"] for row in rows}), 1)
        states = ["valid", "degenerate", "inverted"]
        vtk_types = {"triangle": 5, "quad": 9, "tetrahedron": 10, "hexahedron": 12, "wedge": 13,
                     "pyramid": 14}
        self.assertEqual(arrays["centre"][1], (len(rows), 3))
        for n, row in enumerate(rows):
            self.assertEqual(int(row["id"]), arrays["id"][0][n])
            self.assertEqual(vtk_types[row["type"]], arrays["type"][0][n])
            self.assertEqual(states.index(row["state"]), arrays["state"][0][n])
            self.assertEqual(tuple(float(row[axis]) for axis in "xyz"),
                             arrays["centre"][0][3 * n:3 * n + 3])
            for name in list(row)[6:]:
                value = arrays[name][0][n]
                self.assertEqual(row[name] == "", math.isnan(value))
                if row[name]:
                    self.assertEqual(float(row[name]), value)
                    self.assertEqual(float(columns[name][n]), value)
                else:
                    self.assertIsNone(columns[name][n])
            for name in ("id", "type", "state"):
                self.assertEqual(str(columns[name][n]), row[name])

    def test_numpy_reads_the_arrays(self):
        try:
            import numpy
        except ImportError:
            self.skipTest("numpy is not installed (python3-numpy)")
        mesh = self.generate("in.vtu")
        self.run_cli("quality", mesh, "--npz", self.path("q.npz"))
        with numpy.load(self.path("q.npz")) as arrays:
            for name, (values, shape) in read_npz(self.path("q.npz")).items():
                self.assertEqual(arrays[name].shape, shape)
                self.assertEqual(arrays[name].ravel().tolist(), list(values))

    def test_json_stays_alone_on_the_output(self):
        mesh = self.generate("in.vtu")
        plain = json.loads(self.run_cli("quality", mesh, "--json").stdout)
        result = self.not_met(mesh, "--json", "--metrics", "edge_ratio,skewness", "--require",
                              "min mean_ratio > 2")
        answer = json.loads(result.stdout)
        metrics = answer.pop("shape_metrics")
        self.assertEqual([row["metric"] for row in metrics], ["edge_ratio", "skewness"])
        self.assertGreater(answer.pop("faces")["internal_face_count"], 1000)
        self.assertEqual(answer, plain)
        self.assertIn("NOT MET  min mean_ratio > 2", result.stderr)

    def test_metrics_are_written_as_cell_arrays(self):
        mesh = self.generate("in.vtu")
        self.run_cli("quality", mesh, "--metrics", "aspect_ratio,condition_number", "-o",
                     self.path("out.vtk"))
        data = Path(self.path("out.vtk")).read_bytes()
        for name in (b"mean_ratio", b"aspect_ratio", b"condition_number"):
            self.assertRegex(data, rb"\n" + name + rb" 1 \d+ float\n")

    def test_files_that_cannot_be_written_are_found_before_the_work(self):
        mesh = self.generate("in.vtu")
        for flag in ("--csv", "--npz", "--elements-json"):
            error = self.error_of("quality", mesh, flag, self.path("none/q"), exit_code=1)
            self.assertIn("FILE_NOT_WRITABLE", error)


if __name__ == "__main__":
    main()
