"""Nodes that belong together, end to end: in pairs, on periodic sides, at one position."""

import itertools
import json
import math
import struct
from pathlib import Path

from programs import BAD_MESH, USAGE, CliTest, ServerProgram, main, read_vtk_points, vtk_text

COUNT = 5  # nodes along each edge
METHODS = ("laplacian", "smart-laplacian", "taubin", "hc-laplacian", "windowed-sinc", "optimize")


def grid():
    return list(itertools.product(range(COUNT), repeat=3))


def shaken(i):
    """A node of the grid, off its place inside the mesh."""
    inside = all(0 < c < COUNT - 1 for c in i)
    return [c + 0.2 * inside * math.sin(7 * (i[0] + 3 * i[1] + 5 * i[2]) + k)
            for k, c in enumerate(i)]


def curved(x, y, z):
    """From x = 0 to the other end a sixth of a turn about an axis along z."""
    turn = math.pi / 3 * x / (COUNT - 1)
    return [(3 + y) * math.sin(turn), (3 + y) * math.cos(turn), z]


class PairsTest(CliTest):

    def box(self, name, place=lambda *p: list(p), **sets):
        """Hexahedra, with point arrays that name nodes of the grid."""
        number = {i: k for k, i in enumerate(grid())}
        square = [(0, 0), (1, 0), (1, 1), (0, 1)]
        cells = [[number[x + u, y + v, z + w] for w in (0, 1) for u, v in square]
                 for x, y, z in grid() if max(x, y, z) < COUNT - 1]
        text = vtk_text([place(*shaken(i)) for i in grid()], cells, 12)
        text += f"POINT_DATA {len(number)}\n"
        for set_name, chosen in sets.items():
            text += f"SCALARS {set_name} int 1\nLOOKUP_TABLE default\n"
            text += "\n".join(str(int(chosen(i))) for i in grid()) + "\n"
        Path(self.path(name)).write_text(text)
        return self.path(name)

    def points(self, name):
        data = read_vtk_points(self.path(name))
        numbers = struct.unpack(f">{len(data) // 8}d", data)
        return [numbers[at:at + 3] for at in range(0, len(numbers), 3)]

    def smooth(self, mesh, *arguments):
        self.run_cli("smooth", mesh, "-o", self.path("start.vtk"), "--iterations", "0", "--quiet")
        result = self.run_cli("smooth", mesh, "-o", self.path("out.vtk"), "--report",
                              self.path("report.json"), *arguments)
        report = json.loads(Path(self.path("report.json")).read_text())
        return self.points("start.vtk"), self.points("out.vtk"), report, result.stdout


class PeriodicTest(PairsTest):

    def sides(self, place=lambda *p: list(p)):
        return self.box("in.vtk", place, left=lambda i: i[0] == 0,
                        right=lambda i: i[0] == COUNT - 1)

    def test_sides_stay_matched_by_every_method_under_every_boundary(self):
        ends = [k for k, i in enumerate(grid()) if i[0] in (0, COUNT - 1)]
        for place in (lambda *p: list(p), curved):
            mesh = self.sides(place)
            for method, boundary in itertools.product(METHODS, ("fixed", "slide", "free")):
                if (method, boundary) == ("optimize", "free"):
                    continue
                with self.subTest(place=place, method=method, boundary=boundary):
                    before, after, report, output = self.smooth(
                        mesh, "--periodic", "left", "right", "--method", method, "--boundary",
                        boundary, "--iterations", "3", "--never-worse", "off")
                    self.assertEqual([before[k] for k in ends], [after[k] for k in ends])
                    self.assertNotEqual(before, after)
                    self.assertEqual(report["nodes"]["paired"], str(len(ends)))
                    self.assertIn(f"{len(ends)} in pairs stay", output)

    def test_several_pairs_of_sides_by_a_server(self):
        mesh = self.box("in.vtk", left=lambda i: i[0] == 0, right=lambda i: i[0] == COUNT - 1,
                        low=lambda i: i[1] == 0, high=lambda i: i[1] == COUNT - 1)
        held = [k for k, i in enumerate(grid()) if i[0] in (0, 4) or i[1] in (0, 4)]
        with ServerProgram() as server:
            before, after, report, _ = self.smooth(
                mesh, "--periodic", "left", "right", "--periodic", "low", "high", "--boundary",
                "slide", "--server", server.address)
        self.assertEqual([before[k] for k in held], [after[k] for k in held])
        self.assertEqual(report["nodes"]["paired"], str(len(held)))

    def test_sides_that_do_not_match_are_named(self):
        mesh = self.box("in.vtk", left=lambda i: i[0] == 0, right=lambda i: i[0] == COUNT - 1,
                        part=lambda i: i[0] == 0 and i[1] < 3,
                        other=lambda i: i[0] == 4 and i[1] + i[2] > 3 and (i[1], i[2]) != (4, 0))
        for a, b, text in (("left", "part", '"left" has 25 nodes, "part" has 15'),
                           ("left", "top", '"top"')):
            error = self.error_of("smooth", mesh, "-o", self.path("out.vtk"), "--periodic", a, b,
                                  exit_code=USAGE)
            self.assertIn(text, error)
        even = self.box("in.vtk", part=lambda i: i[0] == 0 and i[2] == 0,
                        other=lambda i: i[0] == 4 and i[1] == i[2])
        error = self.error_of("smooth", even, "-o", self.path("out.vtk"), "--periodic", "part",
                              "other", exit_code=USAGE)
        self.assertIn('no translation or rotation takes "part" to "other"', error)

    def test_a_motion_takes_both_sides_or_none(self):
        mesh = self.sides()
        self.box("to.vtk", lambda x, y, z: [x, y + 0.1 * math.sin(z), z])
        arguments = ["move", mesh, "-o", self.path("out.vtk"), "--to", self.path("to.vtk"),
                     "--periodic", "left", "right"]
        self.run_cli(*arguments)
        after = self.points("out.vtk")
        number = {i: k for k, i in enumerate(grid())}
        for y, z in itertools.product(range(COUNT), repeat=2):
            a, b = after[number[0, y, z]], after[number[COUNT - 1, y, z]]
            self.assertEqual([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [COUNT - 1, 0, 0])
        error = self.error_of(*arguments, "--prescribed-set", "left", exit_code=BAD_MESH)
        self.assertIn("prescribe both or none", error)

    def test_coincident_nodes_are_smoothed_as_one(self):
        inside = range(1, 4)
        place = {(x, y): [x + 0.3 * (x in inside and y in inside) * math.sin(7 * x + 3 * y),
                          y + 0.2 * (x in inside and y in inside) * math.sin(5 * x + y), 0]
                 for x, y in itertools.product(range(5), repeat=2)}
        quads = [[(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
                 for x, y in itertools.product(range(4), repeat=2)]
        # Numbered by the first node at each position; the others are in no element.
        all_nodes = [at for quad in quads for at in quad]
        number = {at: all_nodes.index(at) for at in place}
        Path(self.path("one.vtk")).write_text(
            vtk_text([place[at] for at in all_nodes],
                     [[number[at] for at in quad] for quad in quads], 9))
        Path(self.path("in.vtk")).write_text(
            vtk_text([place[at] for quad in quads for at in quad],
                     [range(4 * k, 4 * k + 4) for k in range(len(quads))], 9))
        self.run_cli("smooth", self.path("one.vtk"), "-o", self.path("expected.vtk"),
                     "--tolerance", "0", "--iterations", "200")
        expected = self.points("expected.vtk")
        before, after, report, output = self.smooth(self.path("in.vtk"), "--merge-coincident",
                                                       "--tolerance", "0", "--iterations", "200")
        self.assertNotEqual(before, after)
        self.assertEqual(after, [expected[number[at]] for at in all_nodes])
        by_position = {}
        for old, new in zip(before, after):
            self.assertEqual(by_position.setdefault(old, new), new)
        self.assertEqual(len(after), 64)
        self.assertIn("39 coincident nodes followed another at the same position\n", output)
        self.assertEqual(report["quality_after"]["inverted_element_count"], "0")

    def test_motion_of_coincident_nodes(self):
        square = [(0, 0), (1, 0), (1, 1), (0, 1)]
        for name, stretch in (("in.vtk", 1), ("to.vtk", 1.2)):
            points = [((x + u) * stretch, y + v, 0)
                      for x, y in itertools.product(range(3), repeat=2) for u, v in square]
            Path(self.path(name)).write_text(
                vtk_text(points, [range(4 * k, 4 * k + 4) for k in range(9)], 9))
        self.run_cli("move", self.path("in.vtk"), "-o", self.path("out.vtk"), "--to",
                     self.path("to.vtk"), "--merge-coincident")
        for a, b in zip(self.points("out.vtk"), self.points("to.vtk")):
            for p, q in zip(a, b):
                self.assertAlmostEqual(p, q, delta=0.05)


if __name__ == "__main__":
    main()
