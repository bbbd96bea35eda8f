"""Pairs of nodes that a file names, end to end: they are held, unless they are ignored."""

import itertools
import math
from pathlib import Path

from periodic_test import COUNT, PairsTest, curved, grid, shaken
from programs import BAD_MESH, main

BOX_SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


class FilePairsTest(PairsTest):
    FLAGS = (("optimize", "--goal", "worst"), ("optimize", "--goal", "average"),
             ("smart-laplacian",), ("laplacian",), ("taubin",))

    def cells(self):
        number = {i: k for k, i in enumerate(grid(), 1)}
        square = [(0, 0), (1, 0), (1, 1), (0, 1)]
        return [[number[x + u, y + v, z + w] for w in (0, 1) for u, v in square]
                for x, y, z in grid() if max(x, y, z) < COUNT - 1]

    def pairs(self):
        number = {i: k for k, i in enumerate(grid(), 1)}
        return [(number[0, y, z], number[COUNT - 1, y, z])
                for y, z in itertools.product(range(COUNT), repeat=2)]

    def msh(self, place):
        nodes = [f"{k} " + " ".join(map(repr, map(float, place(*shaken(i)))))
                 for k, i in enumerate(grid(), 1)]
        cells = [f"{k} 5 2 1 1 " + " ".join(map(str, cell))
                 for k, cell in enumerate(self.cells(), 1)]
        pairs = [f"{b} {a}" for a, b in self.pairs()]
        return "\n".join(["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(nodes)),
                          *nodes, "$EndNodes", "$Elements", str(len(cells)), *cells,
                          "$EndElements", "$Periodic", "1", "2 2 1", str(len(pairs)), *pairs,
                          "$EndPeriodic", ""])

    def inp(self, place):
        nodes = [f"{k}, " + ", ".join(map(repr, map(float, place(*shaken(i)))))
                 for k, i in enumerate(grid(), 1)]
        cells = [f"{k}, " + ", ".join(map(str, cell)) for k, cell in enumerate(self.cells(), 1)]
        # By a control node, as of a representative volume.
        equations = [f"3\n{b}, {d}, 1., {a}, {d}, -1., 1000, {d}, -1."
                     for a, b in self.pairs() for d in (1, 2, 3)]
        return "\n".join(["*NODE", *nodes, "1000, 0., 0., 0.", "*ELEMENT, TYPE=C3D8", *cells,
                          "*EQUATION", *equations, ""])

    def foam(self, place):
        """The case of OpenFOAM, whose sides are cyclic patches; returns its path."""
        owners = {}
        for cell, nodes in enumerate(self.cells()):
            for side in BOX_SIDES:
                face = [nodes[n] - 1 for n in side]
                owners.setdefault(frozenset(face), []).append((cell, face))
        inner = sorted((uses for uses in owners.values() if len(uses) == 2),
                       key=lambda uses: (uses[0][0], uses[1][0]))
        outer = [uses[0] for uses in owners.values() if len(uses) == 1]
        places = list(grid())
        ends = {"left": 0, "right": COUNT - 1}
        patches = {name: [use for use in outer if all(places[n][0] == x for n in use[1])]
                   for name, x in ends.items()}
        patches["rest"] = [use for use in outer if not any(use in patches[name] for name in ends)]
        faces = [uses[0] for uses in inner] + list(itertools.chain(*patches.values()))
        first, entries = len(inner), []
        for name, uses in patches.items():
            other = {"left": "right", "right": "left"}.get(name)
            kind = f"type cyclic; neighbourPatch {other};" if other else "type wall;"
            entries.append(f"{name} {{ {kind} nFaces {len(uses)}; startFace {first}; }}")
            first += len(uses)
        folder = Path(self.path("case"), "constant", "polyMesh")
        folder.mkdir(parents=True, exist_ok=True)
        for name, kind, items in (
                ("points", "vectorField", [f"({x!r} {y!r} {z!r})" for x, y, z in
                                           (map(float, place(*shaken(i))) for i in grid())]),
                ("faces", "faceList", [f"4({' '.join(map(str, face))})" for _, face in faces]),
                ("owner", "labelList", [str(cell) for cell, _ in faces]),
                ("neighbour", "labelList", [str(uses[1][0]) for uses in inner]),
                ("boundary", "polyBoundaryMesh", entries)):
            head = f"FoamFile {{ version 2.0; format ascii; class {kind}; object {name}; }}"
            (folder / name).write_text("\n".join([head, str(len(items)), "(", *items, ")", ""]))
        path = Path(self.path("case"), "case.foam")
        path.touch()
        return str(path)

    def path_of(self, name, place=lambda *p: list(p)):
        if name == "foam":
            return self.foam(place)
        Path(self.path("in." + name)).write_text(getattr(self, name)(place))
        return self.path("in." + name)

    def test_pairs_of_the_file_can_be_ignored(self):
        sides = {k for k, i in enumerate(grid()) if i[0] in (0, COUNT - 1)}
        for name in ("msh", "inp", "foam"):
            mesh = self.path_of(name)
            for flags, held in (([], True), (["--file-pairs", "on"], True),
                                (["--file-pairs", "off"], False)):
                with self.subTest(format=name, flags=flags):
                    before, after, report, output = self.smooth(
                        mesh, "--boundary", "free", "--method", "laplacian", "--iterations", "2",
                        "--never-worse", "off", *flags)
                    moved = {k for k in sides if before[k] != after[k]}
                    self.assertEqual(not moved, held)
                    self.assertEqual("in pairs stay" in output, held)
                    self.assertEqual(report["nodes"].get("paired", "0"),
                                     str(len(sides) if held else 0))

    def test_pairs_between_zones_of_cgns_can_be_ignored(self):
        mesh = str(Path(__file__).parents[1] / "formats" / "files" / "zones.cgns")
        if ".cgns" not in self.run_cli("smooth", "--help").stdout:
            self.skipTest("this build has no HDF5")
        flags = ["smooth", mesh, "-o", self.path("out.cgns"), "--boundary", "free", "--method",
                 "laplacian", "--never-worse", "off"]
        self.assertIn("8 in pairs stay", self.run_cli(*flags).stdout)
        self.assertNotIn("in pairs", self.run_cli(*flags, "--file-pairs", "off").stdout)

    def test_a_motion_of_one_of_a_pair_names_the_option(self):
        mesh, to = self.path_of("foam"), self.path("to.vtk")
        self.run_cli("smooth", mesh, "-o", to, "--iterations", "0", "--quiet")
        arguments = ["move", mesh, "-o", self.path("out.vtk"), "--to", to, "--prescribed-set",
                     "left"]
        error = self.error_of(*arguments, exit_code=BAD_MESH)
        self.assertIn("prescribe both or none, or ignore the pairs that the file names "
                      "(--file-pairs off, file_pairs=False)", error)
        self.run_cli(*arguments, "--file-pairs", "off")

    def test_nodes_stay_matched_by_every_method_and_are_counted(self):
        ends = [k for k, i in enumerate(grid()) if i[0] in (0, COUNT - 1)]
        for name, place in (("msh", lambda *p: list(p)), ("inp", curved), ("foam", curved)):
            mesh = self.path_of(name, place)
            for flags, boundary in itertools.product(self.FLAGS, ("fixed", "slide")):
                with self.subTest(format=name, place=place, flags=flags, boundary=boundary):
                    before, after, report, output = self.smooth(
                        mesh, "--method", *flags, "--boundary", boundary, "--iterations", "3",
                        "--never-worse", "off")
                    self.assertEqual([before[k] for k in ends], [after[k] for k in ends])
                    self.assertNotEqual(before, after)
                    self.assertEqual(report["nodes"]["paired"], str(len(ends)))
                    self.assertIn(f"{len(ends)} in pairs stay", output)

    def test_a_motion_takes_both_of_a_pair(self):
        for name in ("msh", "inp"):
            mesh = self.path("in." + name)
            Path(mesh).write_text(getattr(self, name)(lambda *p: list(p)))
            Path(self.path("to." + name)).write_text(
                getattr(self, name)(lambda x, y, z: [x, y + 0.1 * math.sin(z), z]))
            arguments = ["move", mesh, "-o", self.path("out.vtk"), "--to", self.path("to." + name)]
            self.run_cli(*arguments)
            after = self.points("out.vtk")
            for a, b in self.pairs():
                self.assertEqual([q - p for p, q in zip(after[a - 1], after[b - 1])],
                                 [COUNT - 1, 0, 0])


if __name__ == "__main__":
    main()
