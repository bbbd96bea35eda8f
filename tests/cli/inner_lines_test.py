"""Lines that files of every format name inside plane and curved meshes: their nodes stay, under every
boundary policy, and the summary names them."""

import json
import random
import struct
from pathlib import Path

from programs import CliTest, main, read_vtk_points

FILES = Path(__file__).parents[1] / "formats" / "files"
COUNT = 5
LINE = [2 + COUNT * j for j in range(COUNT)]
EDGES = list(zip(LINE, LINE[1:]))
QUADS = [[i + COUNT * j, i + 1 + COUNT * j, i + 1 + COUNT * (j + 1), i + COUNT * (j + 1)]
         for j in range(COUNT - 1) for i in range(COUNT - 1)]
LEFT = [2, 6, 10, 14]  # of the line, from 1: of each, the edge on the line is the second


def flat(x, y):
    return x, y, 0.0


def wavy(x, y):
    return x, y, 0.05 * (x * x + y * y)


def points(place):
    shake = random.Random(5)
    inside = range(1, COUNT - 1)
    return [place(x + shake.uniform(-0.2, 0.2) * (x in inside and y in inside and x != 2),
                  y + shake.uniform(-0.2, 0.2) * (x in inside and y in inside))
            for y in range(COUNT) for x in range(COUNT)]


def numbered(rows, separator=" ", first=1):
    return [separator.join(map(str, [number, *row])) for number, row in enumerate(rows, first)]


def one(cells):
    return [[node + 1 for node in cell] for cell in cells]


def abaqus(element_type, more):
    def text(place):
        return "\n".join(["*NODE", *numbered(points(place), ", "),
                          f"*ELEMENT, TYPE={element_type}, ELSET=all", *numbered(one(QUADS), ", "),
                          "*ELSET, ELSET=left", ", ".join(map(str, LEFT)), *more, ""])
    return text


def bars():
    rows = numbered(one(EDGES), ", ", 101)
    return ["*ELEMENT, TYPE=T3D2, ELSET=fault", *rows]


def su2(place):
    nodes = [" ".join(map(repr, point[:2])) for point in points(place)]
    quads = [" ".join(map(str, [9, *quad])) for quad in QUADS]
    edges = [f"3 {a} {b}" for a, b in EDGES]
    return "\n".join(["NDIME= 2", f"NELEM= {len(QUADS)}", *quads, f"NPOIN= {len(nodes)}", *nodes,
                      "NMARK= 2", "MARKER_TAG= side", "MARKER_ELEMS= 1", "3 0 1",
                      "MARKER_TAG= fault", f"MARKER_ELEMS= {len(edges)}", *edges, ""])


def msh(place):
    cells = [f"3 2 1 1 {' '.join(map(str, quad))}" for quad in one(QUADS)]
    cells += [f"1 2 2 2 {a} {b}" for a, b in one(EDGES)]
    return "\n".join(["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "2",
                      '2 1 "plate"', '1 2 "fault"', "$EndPhysicalNames", "$Nodes",
                      str(COUNT * COUNT), *numbered(points(place)), "$EndNodes", "$Elements",
                      str(len(cells)), *(f"{n} {c}" for n, c in enumerate(cells, 1)),
                      "$EndElements", ""])


def medit(place):
    return "\n".join(["MeshVersionFormatted 2", "Dimension 3", "Vertices", str(COUNT * COUNT),
                      *(" ".join(map(str, [*point, 0])) for point in points(place)),
                      "Quadrilaterals", str(len(QUADS)),
                      *(" ".join(map(str, [*quad, 1])) for quad in one(QUADS)),
                      "Edges", str(len(EDGES)), *(f"{a} {b} 7" for a, b in one(EDGES)), "End", ""])


def unv(place):
    def integers(*numbers):
        return "".join(f"{number:10d}" for number in numbers)

    def data_set(number, lines):
        return ["    -1", f"  {number}", *lines, "    -1"]
    nodes, elements = [], []
    for label, point in enumerate(points(place), 1):
        nodes += [integers(label, 1, 1, 11), "".join(f"{x:25.16E}" for x in point)]
    for label, quad in enumerate(one(QUADS), 1):
        elements += [integers(label, 94, 1, 1, 7, 4), integers(*quad)]
    for label, edge in enumerate(one(EDGES), 101):
        elements += [integers(label, 11, 1, 1, 7, 2), integers(0, 1, 1), integers(*edge)]
    group = [integers(1, 0, 0, 0, 0, 0, 0, len(EDGES)), "fault"]
    group += [integers(8, 101 + n, 0, 0) for n in range(len(EDGES))]
    return "\n".join(data_set(2411, nodes) + data_set(2412, elements) + data_set(2467, group)) + "\n"


def nastran(place):
    return "\n".join(["BEGIN BULK", *(f"GRID,{n},,{x:.5f},{y:.5f},{z:.5f}"
                                      for n, (x, y, z) in enumerate(points(place), 1)),
                      *(f"CQUAD4,{n},1,{','.join(map(str, quad))}"
                        for n, quad in enumerate(one(QUADS), 1)),
                      *(f"CROD,{n},2,{a},{b}" for n, (a, b) in enumerate(one(EDGES), 101)),
                      "ENDDATA", ""])


def vtk(place):
    cells = QUADS + [list(edge) for edge in EDGES]
    return "\n".join(["# vtk DataFile Version 3.0", "test", "ASCII", "DATASET UNSTRUCTURED_GRID",
                      f"POINTS {COUNT * COUNT} double",
                      *(" ".join(map(repr, point)) for point in points(place)),
                      f"CELLS {len(cells)} {sum(len(cell) + 1 for cell in cells)}",
                      *(" ".join(map(str, [len(cell), *cell])) for cell in cells),
                      f"CELL_TYPES {len(cells)}", *["9"] * len(QUADS), *["3"] * len(EDGES), ""])


def obj(place):
    return "\n".join([*(f"v {x} {y} {z}" for x, y, z in points(place)),
                      *("f " + " ".join(map(str, quad)) for quad in one(QUADS)),
                      *(f"l {a} {b}" for a, b in one(EDGES)), ""])


def xdmf(place):
    def numbers(rows):
        return "\n".join(" ".join(map(str, row)) for row in rows)
    return f"""<Xdmf><Domain><Grid Name="mesh">
<Topology TopologyType="Quadrilateral" NumberOfElements="{len(QUADS)}">
<DataItem DataType="Int" Dimensions="{len(QUADS)} 4">{numbers(QUADS)}</DataItem></Topology>
<Geometry GeometryType="XYZ"><DataItem DataType="Float" Precision="8"
 Dimensions="{COUNT * COUNT} 3">{numbers(points(place))}</DataItem></Geometry></Grid>
<Grid Name="lines"><Topology TopologyType="PolyLine" NodesPerElement="2">
<DataItem DataType="Int" Dimensions="{len(EDGES) + 1} 2">{numbers([*EDGES, (0, 5)])}
</DataItem></Topology><Attribute Name="lines" Center="Cell">
<DataItem DataType="Int">3 3 3 3 0</DataItem></Attribute></Grid></Domain></Xdmf>"""


TEXTS = {  # by the name of the file, the text and what the summary calls the line
    "plane.inp": (abaqus("CPS4", ["*SURFACE, NAME=fault", "left, S2"]), ": fault"),
    "shell.inp": (abaqus("S4", ["*SURFACE, NAME=fault", "left, E2"]), ": fault"),
    "ccx.inp": (abaqus("S4R", ["*SURFACE, NAME=fault", "left, S4"]), ": fault"),
    "bars.inp": (abaqus("S4", bars()), ": fault"),
    "a.su2": (su2, ": fault"), "a.msh": (msh, ": fault"), "a.mesh": (medit, ""),
    "a.unv": (unv, ": fault"), "a.bdf": (nastran, ": 2"), "a.vtk": (vtk, ""), "a.obj": (obj, ""),
    "a.xdmf": (xdmf, ": lines:3"),
}
FIXTURES = {"inner_line.exo": ": fault", "inner_line_shells.exo": ": fault",
            "inner_line.cgns": ": lines, fault", "inner_line_vertices.cgns": ": fault",
            "inner_line.med": ": fault"}
PLANE_ONLY = {"plane.inp", "a.su2"}
WAYS = (("--boundary", "slide"), ("--boundary", "free", "--method", "smart-laplacian"),
        ("--boundary", "slide", "--method", "laplacian"), ("--method", "optimize"))


class InnerLines(CliTest):
    def places(self, name):
        data = read_vtk_points(self.path(name))
        numbers = struct.unpack(f">{len(data) // 8}d", data)
        return [numbers[n:n + 3] for n in range(0, len(numbers), 3)]

    def check(self, path, called, *way):
        """The line stays, while other nodes inside move; and the same nodes as `--fixed-set`."""
        with self.subTest(path=str(path), way=way):
            report = self.path("report.json")
            output = self.run_cli("smooth", path, "-o", self.path("out.vtk"), "--never-worse",
                                  "off", "--iterations", "5", "--report", report, *way).stdout
            self.run_cli("smooth", path, "-o", self.path("in.vtk"), "--method", "laplacian",
                         "--relaxation", "1e-300", "--iterations", "1")
            before, after = self.places("in.vtk"), self.places("out.vtk")
            moved = {n for n, (a, b) in enumerate(zip(before, after)) if a != b}
            self.assertFalse(moved & set(LINE))
            self.assertTrue(moved & {6, 8, 11, 13, 16, 18})
            self.assertEqual(json.loads(Path(report).read_text())["quality_after"].get(
                "inverted_element_count", "0"), "0")
            # Cells are fixed with the boundary, and said of only where it moves.
            if "--boundary" in way:
                self.assertIn("nodes of surfaces, lines and points inside the mesh stay"
                              + called + "\n", output)

    def test_they_stay_in_every_format(self):
        for number, (name, (text, called)) in enumerate(TEXTS.items()):
            Path(self.path(name)).write_text(text(flat))
            self.check(self.path(name), called, *WAYS[number % 3])
            self.check(self.path(name), called, *WAYS[3])
        for number, (name, called) in enumerate(FIXTURES.items()):
            self.check(FILES / name, called, *WAYS[number % 3])
            self.check(FILES / name, called, *WAYS[3])

    def test_they_stay_in_curved_surfaces(self):
        for number, (name, (text, called)) in enumerate(TEXTS.items()):
            if name in PLANE_ONLY:
                continue
            Path(self.path(name)).write_text(text(wavy))
            self.check(self.path(name), called, *WAYS[number % 2])

    def test_sets_on_the_boundary_slide_with_it(self):
        Path(self.path("a.inp")).write_text(
            abaqus("CPS4", ["*ELSET, ELSET=low, GENERATE", "1, 4", "*SURFACE, NAME=foot",
                            "low, S1"])(flat))
        output = self.run_cli("smooth", self.path("a.inp"), "-o", self.path("out.vtk"),
                              "--boundary", "slide").stdout
        self.assertNotIn("inside the mesh", output)


if __name__ == "__main__":
    main()
