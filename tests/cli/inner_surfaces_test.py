"""Surfaces and lines that a file names inside a mesh, in meshes of every element type: they stay
where the boundary slides or is free."""

import itertools
import json
import random
from pathlib import Path

from programs import CliTest, main, vtk_text

N = 4  # boxes along each edge; the sheet lies in x = 2
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
TRIANGLE, QUAD, TETRAHEDRON, HEXAHEDRON, WEDGE, PYRAMID, LINE = 5, 9, 10, 12, 13, 14, 3
EDGES = {
    LINE: [(0, 1)],
    TRIANGLE: [(0, 1), (1, 2), (2, 0)],
    QUAD: [(0, 1), (1, 2), (2, 3), (3, 0)],
    TETRAHEDRON: [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    HEXAHEDRON: [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5),
                 (2, 6), (3, 7)],
    WEDGE: [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    PYRAMID: [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)],
}
FACETS = {
    TRIANGLE: EDGES[TRIANGLE],
    QUAD: EDGES[QUAD],
    TETRAHEDRON: [(0, 1, 2), (0, 1, 3), (1, 2, 3), (2, 0, 3)],
    HEXAHEDRON: [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6),
                 (3, 0, 4, 7)],
    WEDGE: [(0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)],
    PYRAMID: [(0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
}
SECOND_ORDER = {LINE: 21, TRIANGLE: 22, QUAD: 23, TETRAHEDRON: 24, HEXAHEDRON: 25, WEDGE: 26,
                PYRAMID: 27}
BOX_SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def facet_type(nodes):
    return {2: LINE, 3: TRIANGLE, 4: QUAD}[len(nodes)]


def split(kind, box, centre):
    """A box, or square, of corners in VTK's order as cells of one type."""
    if kind in (QUAD, HEXAHEDRON):
        return [box]
    if kind == TRIANGLE:
        return [(box[0], box[1], box[2]), (box[0], box[2], box[3])]
    if kind == WEDGE:
        return [(box[0], box[2], box[1], box[4], box[6], box[5]),
                (box[0], box[3], box[2], box[4], box[7], box[6])]
    if kind == PYRAMID:
        return [(*(box[n] for n in reversed(side)), centre) for side in BOX_SIDES]
    around = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
    return [tuple(box[n] for n in order) for order in around]


class Grid:
    """A square or cube of cells of one type, shaken inside but in the plane x = 2."""

    def __init__(self, kind, place=lambda *p: p):
        self.kind = kind
        dimension = 2 if kind in (TRIANGLE, QUAD) else 3
        shake = random.Random(8)
        lattice = list(itertools.product(range(N + 1), repeat=dimension))
        number = {i: k for k, i in enumerate(lattice)}
        self.flat = [[*i, *[0] * (3 - dimension)] for i in lattice]  # before it is shaken
        self.cells = []
        for corner in itertools.product(range(N), repeat=dimension):
            def at(u, v, w):
                return number[tuple(c + s for c, s in zip(corner, (u, v, w)))]
            box = [at(u, v, w) for w in ((0, 1) if dimension == 3 else (0,)) for u, v in SQUARE]
            centre = len(self.flat)
            if kind == PYRAMID:
                self.flat.append([c + 0.5 for c in corner])
            self.cells += split(kind, box, centre)
        self.points = []
        for point in self.flat:
            moved = [c + shake.uniform(-0.15, 0.15) * (0 < c < N and (axis > 0 or c != 2))
                     for axis, c in enumerate(point)]
            self.points.append(place(*moved))

    def facets(self, axis, value):
        """Those in a plane of the lattice, each once."""
        found = {}
        for cell in self.cells:
            for facet in FACETS[self.kind]:
                nodes = [cell[n] for n in facet]
                if all(self.flat[n][axis] == value for n in nodes):
                    found[tuple(sorted(nodes))] = nodes
        return list(found.values())

    def text(self, second_order):
        """With the facets in x = 2 and y = 0 as cells; and the nodes of both."""
        inner, side = self.facets(0, 2), self.facets(1, 0)
        cells = [(facet_type(nodes), nodes) for nodes in inner + side]
        cells += [(self.kind, nodes) for nodes in self.cells]
        points = [list(p) for p in self.points]
        if second_order:
            middle = {}

            def between(a, b):
                key = (min(a, b), max(a, b))
                if key not in middle:
                    middle[key] = len(points)
                    points.append([(p + q) / 2 for p, q in zip(points[a], points[b])])
                return middle[key]

            cells = [(SECOND_ORDER[kind],
                      [*nodes, *(between(nodes[a], nodes[b]) for a, b in EDGES[kind])])
                     for kind, nodes in cells]
        text, _ = vtk_text(points, [nodes for _, nodes in cells]).split("CELL_TYPES")
        text += f"CELL_TYPES {len(cells)}\n" + "\n".join(str(kind) for kind, _ in cells) + "\n"
        count = len(inner)
        return (text, {n for _, nodes in cells[:count] for n in nodes},
                {n for _, nodes in cells[count:count + len(side)] for n in nodes})


def wavy(x, y, z):
    return x, y, z + 0.02 * (x * x + y * y)


class InnerSurfaces(CliTest):
    def moved_nodes(self, text, *arguments):
        Path(self.path("in.vtk")).write_text(text)
        output = self.run_cli("smooth", self.path("in.vtk"), "-o", self.path("out.vtk"),
                              "--never-worse", "off", "--report", self.path("report.json"),
                              *arguments).stdout
        before, after = (self.points(name) for name in ("in.vtk", "out.vtk"))
        report = json.loads(Path(self.path("report.json")).read_text())
        self.assertEqual(report["quality_after"].get("inverted_element_count", "0"), "0")
        return {n for n, (a, b) in enumerate(zip(before, after)) if a != b}, output

    def points(self, name):
        words = iter(Path(self.path(name)).read_text().split())
        for word in words:
            if word == "POINTS":
                break
        count = int(next(words))
        next(words)
        return [tuple(float(next(words)) for _ in range(3)) for _ in range(count)]

    def check(self, kind, second_order, place, *arguments):
        text, inner, side = Grid(kind, place).text(second_order)
        with self.subTest(kind=kind, second_order=second_order, arguments=arguments):
            moved, output = self.moved_nodes(text, "--iterations", "4", *arguments)
            self.assertFalse(moved & inner)
            self.assertTrue(moved - side)
            self.assertIn("nodes of surfaces, lines and points inside the mesh stay", output)
            return moved & side

    def test_they_stay_in_meshes_of_every_type(self):
        for kind, second_order in itertools.product(FACETS, (False, True)):
            for arguments in (["--boundary", "slide"],
                              ["--boundary", "free", "--method", "smart-laplacian"]):
                along = self.check(kind, second_order, lambda *p: p, *arguments)
                self.assertTrue(along, "the side is on the boundary, and moves")

    def test_sets_of_faces_stay_where_the_boundary_is_fixed(self):
        grid = Grid(HEXAHEDRON)
        inner = {n for n, place in enumerate(grid.flat) if place[0] == 2}
        left = [number for number, cell in enumerate(grid.cells, 1)
                if max(grid.flat[n][0] for n in cell) == 2]
        text = "\n".join(
            ["*NODE", *(f"{n}, {x}, {y}, {z}" for n, (x, y, z) in enumerate(grid.points, 1)),
             "*ELEMENT, TYPE=C3D8",
             *(", ".join(map(str, [number, *(n + 1 for n in cell)]))
               for number, cell in enumerate(grid.cells, 1)),
             "*SURFACE, NAME=fault", *(f"{number}, S4" for number in left), ""])
        Path(self.path("in.inp")).write_text(text)
        output = self.run_cli("smooth", self.path("in.inp"), "-o", self.path("out.inp")).stdout
        lines = text.splitlines()
        after = Path(self.path("out.inp")).read_text().splitlines()
        moved = {n for n in range(len(grid.points)) if lines[n + 1] != after[n + 1]}
        self.assertTrue(moved)
        self.assertFalse(moved & inner)
        self.assertIn("points inside the mesh stay: fault\n", output)

    def test_they_stay_in_curved_surfaces(self):
        for kind, second_order in itertools.product((TRIANGLE, QUAD), (False, True)):
            for boundary in ("slide", "free"):
                self.check(kind, second_order, wavy, "--boundary", boundary)


if __name__ == "__main__":
    main()
