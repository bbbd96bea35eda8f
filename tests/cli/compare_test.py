"""`meshsmooth compare`: what differs between two mesh files."""

import json
import re
from pathlib import Path

from programs import BAD_MESH, CliTest, main, vtk_text

INCOMPLETE = 6


class Compare(CliTest):
    def compare(self, before, after, exit_code=0):
        answer = json.loads(self.run_cli("compare", before, after, "--json",
                                         exit_code=exit_code).stdout)
        text = self.run_cli("compare", before, after, exit_code=exit_code)
        self.assertEqual(answer["only_coordinates"], exit_code == 0)
        self.assertIn("the same" if answer["same_topology"] else "differs",
                      re.search("topology +(.*)", text.stdout)[1])
        for difference in answer["differences"]:
            self.assertIn(difference, text.stdout)
        return answer, text

    def test_smoothing_changes_only_coordinates_in_any_format(self):
        formats = {"in.vtu": "bytes", "in.vtk": "bytes", "in.node": "bytes", "in.msh": "bytes"}
        surfaces = {"in.obj": "bytes", "in.ply": "bytes", "in.vtp": "bytes"}
        for name, by in {**formats, **surfaces}.items():
            with self.subTest(name):
                mesh = self.generate(name, shape="square" if name in surfaces else "cube",
                                     nodes=500)
                better = self.path(name.replace("in", "out"))
                report = json.loads(self.smooth(mesh, better))
                answer, text = self.compare(mesh, better)
                self.assertEqual(answer["compared_by"], by)
                self.assertEqual(answer["nodes"]["moved"], int(report["nodes"]["moved"]))
                self.assertIn("only coordinates differ", text.stdout)
                for when in ("quality_before", "quality_after"):
                    for own, reported in zip(answer[when]["metrics"], report[when]["metrics"],
                                             strict=True):
                        self.assertEqual((own["metric"], own["min"], own["max"]),
                                         (reported["metric"], reported["min"], reported["max"]))
                        self.assertAlmostEqual(own["mean"], reported["mean"], places=9)

    def smooth(self, mesh, output):
        self.run_cli("smooth", mesh, "-o", output, "--report", self.path("report.json"))
        return Path(self.path("report.json")).read_text()

    def test_a_file_equals_itself(self):
        mesh = self.generate("in.vtu")
        answer, text = self.compare(mesh, mesh)
        self.assertEqual(answer["nodes"]["moved"], 0)
        self.assertIn("all bytes are equal", text.stdout)

    def test_the_farthest_node_is_named(self):
        points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        mesh, moved = self.path("a.vtk"), self.path("b.vtk")
        Path(mesh).write_text(vtk_text(points, [[0, 1, 2, 3]]))
        points[1], points[3] = (1.5, 0, 0), (0, 0, 3)
        Path(moved).write_text(vtk_text(points, [[0, 1, 2, 3]]))
        answer, text = self.compare(mesh, moved)
        self.assertEqual(answer["nodes"], {
            "total": 4, "moved": 2, "max": 2, "mean": 1.25,
            "farthest": {"id": 3, "from": [0, 0, 1], "to": [0, 0, 3]}})
        self.assertIn("farthest is node 3, from (0, 0, 1) to (0, 0, 3)", text.stdout)

    def test_any_other_byte_of_a_text_is_found(self):
        mesh = self.generate("in.obj", shape="square", nodes=300)
        text = Path(mesh).read_text()
        faces = text.index("\nf ")
        line = text.count("\n", 0, faces) + 2
        for changed in (text[:faces] + "\n# by hand" + text[faces:], text + "# end\n",
                        "# start\n" + text):
            Path(self.path("changed.obj")).write_text(changed)
            answer, result = self.compare(mesh, self.path("changed.obj"), INCOMPLETE)
            self.assertTrue(answer["same_topology"])
            self.assertRegex(answer["differences"][0], r"text: from line \d+, byte \d+")
            self.assertIn("differ in more than coordinates", result.stderr)
            if "by hand" in changed:
                self.assertIn(f"line {line},", answer["differences"][0])

    def test_arrays_and_elements_are_compared(self):
        points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]
        cells = [[0, 1, 2, 3], [1, 2, 3, 4]]
        text = vtk_text(points, cells)
        arrays = ("CELL_DATA 2\nSCALARS material int 1\nLOOKUP_TABLE default\n1 2\n"
                  "POINT_DATA 5\nVECTORS force double\n" + "1 2 3\n" * 5)
        mesh = self.path("in.vtk")
        Path(mesh).write_text(text + arrays)
        for changed, expected in (
                (text + arrays.replace("1 2\n", "1 3\n", 1), "cell array material: other values"),
                (text + arrays.replace("1 2 3\n", "1 2 4\n", 1), "point array force: other values"),
                (text + arrays.replace("material int", "material float"), "cell array material: int"),
                (text, "only in the first file"),
                (text.replace("1 2 3 4", "2 1 3 4") + arrays,
                 r"elements: 1 \(tetrahedron\) has other nodes"),
                (vtk_text(points, cells[:1]), "elements: 2 and 1"),
                (vtk_text([*points, (5, 5, 5)], cells), "nodes: 5 and 6")):
            Path(self.path("changed.vtk")).write_text(changed)
            answer, _ = self.compare(mesh, self.path("changed.vtk"), INCOMPLETE)
            self.assertRegex("\n".join(answer["differences"]), expected)

    def test_files_of_different_formats_are_compared_as_meshes(self):
        mesh = self.generate("in.vtu")
        self.run_cli("smooth", mesh, "-o", self.path("out.node"))
        answer, text = self.compare(mesh, self.path("out.node"))
        self.assertEqual(answer["compared_by"], "meshes")
        self.assertIn("different formats", text.stdout)

    def test_a_bad_mesh_is_named(self):
        mesh = self.generate("in.vtu")
        points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        Path(self.path("bad.vtk")).write_text(vtk_text(points, [[0, 1, 2, 2]]))
        error = self.error_of("compare", mesh, self.path("bad.vtk"), exit_code=BAD_MESH)
        self.assertIn("bad.vtk", error)


if __name__ == "__main__":
    main()
