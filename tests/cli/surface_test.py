"""Boundary nodes on a given surface, end to end."""

import itertools
import json
import math
import struct
from pathlib import Path

from programs import BAD_MESH, REFUSED, USAGE, CliTest, main, read_vtk_points, vtk_text

SIDES = 6  # cells along each edge


def box_mesh(lower, upper):
    """Hexahedra, with a layer of nodes on the boundary."""
    grid = list(itertools.product(range(SIDES + 1), repeat=3))
    number = {i: k for k, i in enumerate(grid)}
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    cells = [[number[x + u, y + v, z + w] for w in (0, 1) for u, v in square]
             for x, y, z in itertools.product(range(SIDES), repeat=3)]
    return vtk_text([[lower + (upper - lower) * c / SIDES for c in i] for i in grid], cells, 12)


def box_triangles(n=2):
    """The unit cube's surface, as corners of triangles."""
    found = []
    for axis, up, u, v in itertools.product(range(3), (0, 1), range(n), range(n)):
        def at(a, b):
            p = [0.0, 0.0, 0.0]
            p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = up, a / n, b / n
            return p
        corners = [at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)]
        if not up:
            corners.reverse()
        found += [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]
    return found


def stl(triangles):
    """Text, as many programs write it: every triangle with points of its own."""
    lines = ["solid box"]
    for triangle in triangles:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(map(str, p)) for p in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid box", ""])


class SurfaceTest(CliTest):

    def write(self, name, text):
        Path(self.path(name)).write_text(text)
        return self.path(name)

    def fit(self, surface, *arguments, lower=0.04, upper=0.97):
        mesh = self.write("in.vtk", box_mesh(lower, upper))
        result = self.run_cli("smooth", mesh, "-o", self.path("out.vtk"), "--surface", surface,
                              "--report", self.path("report.json"), "--backend", "cpu", *arguments)
        summary = json.loads(Path(self.path("report.json")).read_text())
        data = read_vtk_points(self.path("out.vtk"))
        numbers = struct.unpack(f">{len(data) // 8}d", data)
        points = [numbers[at:at + 3] for at in range(0, len(numbers), 3)]
        return points, summary, result.stdout

    def test_gives_a_box_its_corners_edges_and_sides(self):
        triangles = box_triangles()
        obj = "".join(f"v {' '.join(map(str, p))}\n" for t in triangles for p in t)
        obj += "".join(f"f {3 * k + 1} {3 * k + 2} {3 * k + 3}\n" for k in range(len(triangles)))
        for name, text in ("box.stl", stl(triangles)), ("box.obj", obj):
            with self.subTest(name):
                points, summary, text = self.fit(self.write(name, text))
                fit = summary["fit"]
                self.assertEqual(int(fit["node_count"]), int(fit["reached_count"]))
                self.assertEqual(int(fit["surface"]["patch_count"]), 6)
                self.assertEqual(int(fit["surface"]["curve_count"]), 12)
                at_sides = [sum(c in (0.0, 1.0) for c in p) for p in points]
                self.assertEqual(at_sides.count(3), 8)
                self.assertEqual(at_sides.count(2), 12 * (SIDES - 1))
                self.assertEqual(at_sides.count(1), 6 * (SIDES - 1) ** 2)
                self.assertIn("218 of 218 boundary nodes lie on the surface (6 patches, 12 curves, "
                              "8 corners)", text)

    def test_names_the_nodes_that_it_cannot_bring_there(self):
        far = [[[c + 9 for c in p] for p in t] for t in box_triangles()]
        _, summary, _ = self.fit(self.write("far.stl", stl(far)), "--iterations", "30")
        fit = summary["fit"]
        self.assertEqual(int(fit.get("reached_count", 0)) + int(fit.get("held_count", 0)), 218)
        self.assertEqual(int(summary["quality_after"]["inverted_element_count"]), 0)

    def test_refuses_what_is_no_surface_of_such_a_mesh(self):
        box = self.write("box.stl", stl(box_triangles()))
        mesh = self.write("in.vtk", box_mesh(0, 1))
        out = self.path("out.vtk")
        error = self.error_of("smooth", mesh, "-o", out, "--surface", mesh, exit_code=BAD_MESH)
        self.assertIn("volume elements", error)
        error = self.error_of("smooth", mesh, "-o", out, "--surface", box, "--boundary", "free",
                              exit_code=USAGE)
        self.assertIn("--surface", error)
        error = self.error_of("smooth", mesh, "-o", out, "--surface", box, "--method", "laplacian",
                              exit_code=REFUSED)
        self.assertIn("optimize only", error)
        flat = [[[x, 0.0, 0.0] for x in (0.0, 1.0, math.pi)]]
        error = self.error_of("smooth", mesh, "-o", out, "--surface",
                              self.write("flat.stl", stl(flat)), exit_code=BAD_MESH)
        self.assertIn("no triangle has an area", error)


if __name__ == "__main__":
    main()
