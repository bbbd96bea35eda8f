"""Reports in HTML: complete in themselves, small, and safe whatever files are called."""

import base64
import html.parser
import json
import re
import subprocess
from pathlib import Path

from programs import BAD_MESH, CLI, FAILED, USAGE, CliTest, main, vtk_text

INCOMPLETE = 6
LIMITED = 128  # the highest bit of an element's marks

OUTSIDE = re.compile(r"""https?:|\bsrc\s*=|\bhref\s*=|url\(|@import|(["'(]|=\s*)//\w""", re.IGNORECASE)


class Page(html.parser.HTMLParser):
    """Elements, texts by element, and the scene of a report."""

    def __init__(self, path):
        super().__init__()
        self.text = Path(path).read_text(encoding="utf-8")
        self.open, self.tags, self.texts, self.scene = [], [], {}, ""
        self.scripts = 0
        self.feed(self.text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        self.open.append(tag)
        self.is_scene = dict(attributes).get("id") == "scene"
        self.scripts += tag == "script"

    def handle_endtag(self, tag):
        if tag in self.open:
            while self.open.pop() != tag:
                pass

    def handle_data(self, data):
        if self.open and self.open[-1] == "script" and self.is_scene:
            self.scene += data
        if self.open:
            self.texts[self.open[-1]] = self.texts.get(self.open[-1], "") + data

    def all_text(self):
        return " ".join(text for tag, text in self.texts.items() if tag not in ("script", "style"))


class HtmlReport(CliTest):
    def report_on(self, *arguments, exit_code=0):
        path = self.path("report.html")
        done = subprocess.run([CLI, *arguments, "--html", path], capture_output=True, text=True,
                              timeout=300)
        self.assertEqual(done.returncode, exit_code, done.stderr)
        page = Page(path)
        self.assertIsNone(OUTSIDE.search(page.text))
        self.assertEqual(page.scripts, 2)
        page.data = json.loads(page.scene)
        return page

    def smooth(self, mesh, *arguments):
        return self.report_on("smooth", mesh, "-o", self.path("out.vtu"), *arguments)

    def test_reports_on_a_smoothing(self):
        mesh = self.generate("in.vtu")

        page = self.smooth(mesh, "--history", "--report", self.path("out.json"), "--request-id",
                           "6f2c1d1e-0000-4000-8000-000000000001")

        summary = json.loads(Path(self.path("out.json")).read_text())
        text = page.all_text()
        for part in ("Valid: no element is inverted", "in.vtu → out.vtu", "Converged", "locked",
                     "6f2c1d1e-0000-4000-8000-000000000001", "2,000", "Worst mean ratio",
                     '"optimize"', "Largest move of each sweep"):
            self.assertIn(part, text)
        for stats in ("quality_before", "quality_after"):
            worst = summary[stats]["metrics"][0]["min"]
            self.assertIn(f"{worst:.4f}", text)
        self.assertNotIn(str(self.folder), page.text)
        self.assertTrue(page.data["hasBefore"])
        self.assertNotIn("before", page.data["surface"])  # the boundary is fixed

    def test_says_the_same_with_and_without(self):
        mesh = self.generate("in.vtu")
        self.smooth(mesh)
        with_report = Path(self.path("out.vtu")).read_bytes()
        self.run_cli("smooth", mesh, "-o", self.path("out.vtu"))
        self.assertEqual(with_report, Path(self.path("out.vtu")).read_bytes())

    def test_reports_on_repair_and_on_what_is_left(self):
        mesh = self.generate("in.vtu", tangle=0.3)
        self.assertIn("no element is inverted any more", self.smooth(mesh).all_text())
        page = self.smooth(mesh, "--iterations", "0")
        self.assertRegex(page.all_text(), r"Not valid: [\d,]+ of [\d,]+ elements are inverted")

    def test_reports_on_a_quality(self):
        mesh = self.generate("in.vtu")

        page = self.report_on("quality", mesh)

        self.assertFalse(page.data["hasBefore"])
        worst = json.loads(self.run_cli("quality", mesh, "--json").stdout)["worst_elements"]
        buttons = [a["data-element"] for tag, a in page.tags if "data-element" in a]
        self.assertEqual(len(buttons), 20)
        self.assertEqual(buttons[:len(worst)], [element["element"] for element in worst])

    def test_reports_on_a_motion_that_does_not_arrive(self):
        points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        Path(self.path("in.vtk")).write_text(vtk_text(points, [[0, 1, 2, 3]]))
        points[3] = (0, 0, -1)
        Path(self.path("to.vtk")).write_text(vtk_text(points, [[0, 1, 2, 3]]))

        page = self.report_on("move", self.path("in.vtk"), "--to", self.path("to.vtk"), "-o",
                              self.path("out.vtk"), exit_code=INCOMPLETE)

        self.assertRegex(page.all_text(), r"Valid, but only [\d.]+ % of the motion is reached")
        self.assertIn("a step further 1 element would be inverted", page.all_text().lower())
        self.assertIn("blocks the motion", page.all_text())

    def test_marks_the_elements_that_are_limited_by_connectivity(self):
        mesh = self.generate("in.vtu", nodes=300)  # all its elements are shown
        options = ["--report-below", "0.75", "--report", self.path("out.json")]
        page = self.smooth(mesh, *options)
        poor = json.loads(Path(self.path("out.json")).read_text())["poor"]
        marks = base64.b64decode(page.data["elements"]["marks"])
        limited, expected = sum(mark >= LIMITED for mark in marks), int(poor["limited_count"])
        self.assertGreater(limited, 0)
        self.assertLess(abs(limited - expected), 0.05 * expected)
        self.assertIn("limited", page.texts["td"])

        page = self.smooth(mesh, *options, "--boundary", "slide")
        self.assertIn("limited by connectivity is not marked", page.all_text())
        self.assertFalse(any(mark >= LIMITED
                             for mark in base64.b64decode(page.data["elements"]["marks"])))

    def test_names_elements_as_the_file_does(self):
        points = "\n".join(f"{100 + n} {x} {y} {z}" for n, (x, y, z) in enumerate(
            [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]))
        text = (f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n{points}\n$EndNodes\n"
                "$Elements\n1\n4711 4 2 0 1 100 101 102 103\n$EndElements\n")
        Path(self.path("in.msh")).write_text(text)
        page = self.report_on("quality", self.path("in.msh"))
        self.assertIn("4711", [a.get("data-element") for _, a in page.tags])

    def test_is_small(self):
        for nodes in (30, 2000, 100000):
            with self.subTest(nodes=nodes):
                page = self.report_on("quality", self.generate("in.vtu", nodes=nodes))
                size = len(page.text.encode())
                triangles = int(re.search(r"translucent: ([\d,]+) triangle", page.text)[1]
                                .replace(",", ""))
                self.assertLess(size, 1_500_000 + 60 * triangles)
                self.assertLess(size, 3_000_000)

    def test_works_for_every_kind_of_mesh(self):
        for shape, dimension in (("mixed --nodes 500", 3), ("square --nodes 500", 2),
                                 ("ball --nodes 500", 3), ("layer --elements wedge", 3),
                                 ("layer --elements hex", 3), ("layer --elements quad", 2)):
            with self.subTest(shape=shape):
                self.run_cli("generate", *shape.split(), "-o", self.path("in.vtu"))
                page = self.smooth(self.path("in.vtu"))
                self.assertEqual(page.data["dimension"], dimension)

    def test_is_safe_whatever_files_are_called(self):
        for name in ("<script>alert(1)<!--.vtu", "'\"><img onerror=alert(1)>.vtu", "&amp;{{css}}.vtu",
                     "Gehäuse 网格.vtu", "a\nb\x01.vtu"):
            with self.subTest(name=name):
                mesh = self.generate(name, nodes=100)
                output = self.path("out" + name)
                page = self.report_on("smooth", mesh, "-o", output)
                shown = name.replace("\x01", "\N{REPLACEMENT CHARACTER}")
                self.assertEqual(page.texts["h1"], f"{shown} → out{shown}")
                self.assertEqual([tag for tag, _ in page.tags if tag == "img"], [])

    def test_checks_the_path_before_any_work(self):
        mesh = self.generate("in.vtu", nodes=100)
        output = self.path("out.vtu")
        for path, code in ((self.path("none/report.html"), FAILED), (str(self.folder), FAILED),
                           (output, USAGE)):
            with self.subTest(path=path):
                error = self.error_of("smooth", mesh, "-o", output, "--html", path, exit_code=code)
                self.assertIn("--html" if code == USAGE else path, error)
                self.assertEqual(self.files(), ["in.vtu"])
        self.error_of("quality", mesh, "--html", self.path("none/report.html"), exit_code=FAILED)

    def test_leaves_no_report_on_a_failure(self):
        mesh = self.generate("in.vtu", tangle=0.3)
        self.run_cli("smooth", mesh, "-o", self.path("out.vtu"), "--tangled", "refuse", "--html",
                     self.path("report.html"), exit_code=BAD_MESH)
        self.assertEqual(self.files(), ["in.vtu"])


if __name__ == "__main__":
    main()
