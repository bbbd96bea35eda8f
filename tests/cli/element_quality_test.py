"""Metrics of every element, as cell arrays of the files that the programs write."""

import contextlib
import json
import math
import re
import struct
from pathlib import Path

from programs import BAD_MESH, USAGE, CliTest, ServerProgram, main, vtk_text

TETRAHEDRON = ["mean_ratio", "scaled_jacobian", "radius_ratio", "min_dihedral_angle",
               "max_dihedral_angle"]


def float_arrays(path):
    """The arrays of floats of a legacy VTK file, by name."""
    data = Path(path).read_bytes()
    arrays = {}
    for match in re.finditer(rb"\n(\w+) 1 (\d+) float\n", data):
        count = int(match.group(2))
        if b"\nASCII\n" in data[:400]:
            arrays[match.group(1).decode()] = tuple(
                map(float, data[match.end():].split(maxsplit=count)[:count]))
            continue
        values = data[match.end():match.end() + 4 * count]
        arrays[match.group(1).decode()] = struct.unpack(f">{count}f", values)
    return arrays


class ElementQuality(CliTest):
    def reported(self, path):
        """The statistics of a file's metrics by their names."""
        stats = json.loads(self.run_cli("quality", path, "--json").stdout)
        return {m["metric"].removeprefix("QUALITY_METRIC_").lower(): m for m in stats["metrics"]}

    def check(self, path, names):
        """Whether the file has these arrays alone, of the quality of its own elements."""
        arrays, reported = float_arrays(path), self.reported(path)
        self.assertEqual(sorted(arrays), sorted(names))
        for name in names:
            values = [value for value in arrays[name] if not math.isnan(value)]
            metric = reported[name]
            self.assertEqual(len(values), int(metric["element_count"]), name)
            for value, key in ((min(values), "min"), (max(values), "max"),
                               (math.fsum(values) / len(values), "mean")):
                self.assertAlmostEqual(value, metric[key], delta=1e-6 * max(1, abs(metric[key])))
        return arrays

    def test_quality_writes_every_metric_of_a_mesh(self):
        mesh = self.generate("in.vtu")

        result = self.run_cli("quality", mesh, "-o", self.path("out.vtk"))

        self.check(self.path("out.vtk"), TETRAHEDRON)
        self.assertEqual(result.stdout, self.run_cli("quality", mesh).stdout)

    def test_quality_writes_not_a_number_for_cells_without_a_metric(self):
        # A hexahedron, a pyramid on it and a triangle of their common side.
        points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1),
                  (0, 1, 1), (0.5, 0.5, 1.5), (2, 0, 0)]
        cells = [[4, 5, 6], [4, 5, 6, 7, 8], [0, 1, 2, 3, 4, 5, 6, 7], [1, 9, 2, 5]]
        text = vtk_text(points, cells).replace("\n".join(["10"] * 4), "5\n14\n12\n10")
        Path(self.path("in.vtk")).write_text(text)

        self.run_cli("quality", self.path("in.vtk"), "-o", self.path("out.vtk"))

        arrays = self.check(self.path("out.vtk"), TETRAHEDRON)
        defined = {name: [not math.isnan(value) for value in values]
                   for name, values in arrays.items()}
        self.assertEqual(defined["mean_ratio"], [False, True, True, True])
        self.assertEqual(defined["radius_ratio"], [False, False, False, True])

    def test_smooth_writes_the_metrics_of_the_result(self):
        mesh = self.generate("in.vtu")
        names = ["mean_ratio", "min_dihedral_angle"]
        files = []
        for server in (False, True):
            with contextlib.ExitStack() as stack:
                where = ["--server", stack.enter_context(ServerProgram()).address] * server
                self.run_cli("smooth", mesh, "-o", self.path("out.vtk"), "--element-quality",
                             ",".join(names), *where)
                self.check(self.path("out.vtk"), names)
                files.append(Path(self.path("out.vtk")).read_bytes())
        self.assertEqual(files[0], files[1])
        with self.subTest("the same mesh as without"):
            self.run_cli("smooth", mesh, "-o", self.path("bare.vtk"))
            self.assertEqual(float_arrays(self.path("bare.vtk")), {})
            self.run_cli("quality", self.path("bare.vtk"), "-o", self.path("bare_quality.vtk"))
            of_bare = float_arrays(self.path("bare_quality.vtk"))
            of_result = float_arrays(self.path("out.vtk"))
            self.assertEqual({name: of_bare[name] for name in names}, of_result)

    def test_attach_writes_the_metrics_that_the_job_was_sent_with(self):
        mesh = self.generate("in.vtu")
        with ServerProgram() as server:
            self.run_cli("smooth", mesh, "-o", self.path("sent.vtk"), "--server", server.address,
                         "--element-quality", "radius_ratio", "--result-ttl", "60")
            jobs = self.run_cli("jobs", "--server", server.address).stdout
            name = re.search(r"jobs/\S+", jobs).group()
            self.run_cli("attach", name, mesh, "-o", self.path("attached.vtk"), "--server",
                         server.address)
        self.assertEqual(Path(self.path("attached.vtk")).read_bytes(),
                         Path(self.path("sent.vtk")).read_bytes())

    def test_errors_name_what_is_wrong_before_any_work(self):
        mesh = self.generate("in.vtu")
        files = self.files()
        for output in ("out.mesh", "out.msh", "out.stl", "out.node"):
            error = self.error_of("smooth", mesh, "-o", self.path(output), "--element-quality",
                                  "mean_ratio", exit_code=USAGE)
            self.assertRegex(error, r"cell arrays; with them are \.vtu .*\(ARRAYS_NOT_SUPPORTED\)")
            error = self.error_of("quality", mesh, "-o", self.path(output), exit_code=USAGE)
            self.assertIn("ARRAYS_NOT_SUPPORTED", error)
        error = self.error_of("smooth", mesh, "-o", self.path("out.vtu"), "--element-quality",
                              "mean_ratio,beauty", exit_code=USAGE)
        self.assertRegex(error, "--element-quality.*beauty")
        error = self.error_of("smooth", mesh, "-o", self.path("out.vtu"), "--element-quality",
                              "mean_ratio,radius_ratio,mean_ratio", exit_code=USAGE)
        self.assertIn("element_quality_metrics: mean_ratio is listed twice", error)
        self.assertEqual(self.files(), files)

    def test_quality_of_a_bad_mesh_writes_nothing(self):
        points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        Path(self.path("in.vtk")).write_text(vtk_text(points, [[0, 1, 2, 2]]))

        self.run_cli("quality", self.path("in.vtk"), "-o", self.path("out.vtu"),
                     exit_code=BAD_MESH)

        self.assertEqual(self.files(), ["in.vtk"])


if __name__ == "__main__":
    main()
