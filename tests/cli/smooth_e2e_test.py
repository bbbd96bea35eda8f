"""Smoothing real files by the embedded server and by one of its own."""

import contextlib
import itertools
import json
import math
import random
import re
import struct
from pathlib import Path

from programs import (BAD_MESH, DONE, LONG, REFUSED, STOPPED, USAGE, CliTest, ServerProgram,
                      interrupt, main, read_vtk_points, vtk_text)


def mean_ratio(report, when):
    return next(m for m in report[when]["metrics"] if m["metric"] == "QUALITY_METRIC_MEAN_RATIO")


class Smooth(CliTest):
    def smooth(self, mesh, *arguments, output="out.vtu"):
        report = self.path("report.json")
        result = self.run_cli("smooth", mesh, "-o", self.path(output), "--report", report,
                              *arguments)
        return result, json.loads(Path(report).read_text())

    def test_optimize_is_the_default_and_leaves_a_valid_mesh_valid(self):
        result, report = self.smooth(self.generate("in.vtu"))

        self.assertIn("no element is inverted", result.stdout)
        self.assertEqual(report["options"]["optimize"]["goal"], "GOAL_BALANCED")
        self.assertEqual(report["options"]["form"], "FORM_UNSPECIFIED")
        self.assertEqual(report["stop_reason"], "STOP_REASON_CONVERGED")
        for when in ("quality_before", "quality_after"):
            self.assertEqual(report[when]["inverted_element_count"], "0")
        self.assertGreater(mean_ratio(report, "quality_after")["mean"],
                           mean_ratio(report, "quality_before")["mean"])
        self.assertGreater(mean_ratio(report, "quality_after")["percentile_1"],
                           mean_ratio(report, "quality_before")["percentile_1"])

    def test_goals_put_the_average_or_the_worst_first(self):
        mesh = self.generate("in.vtu")
        average, balanced, worst = (
            mean_ratio(self.smooth(mesh, "--goal", goal)[1], "quality_after")
            for goal in ("average", "balanced", "worst"))

        self.assertGreater(average["mean"], balanced["mean"])
        self.assertGreater(balanced["mean"], worst["mean"])
        self.assertGreater(worst["percentile_1"], average["percentile_1"])

    def test_target_quality_ends_the_job_early(self):
        mesh = self.generate("in.vtu")
        _, whole = self.smooth(mesh, "--goal", "worst", "--history")
        reached = whole["convergence"]["worst_mean_ratios"]
        target = (reached[0] + max(reached)) / 2

        result, report = self.smooth(mesh, "--goal", "worst", "--history",
                                     "--target-quality", target)

        self.assertIn("reached the target quality", result.stdout)
        self.assertEqual(report["stop_reason"], "STOP_REASON_TARGET_REACHED")
        self.assertEqual(report["options"]["target_quality"], target)
        self.assertGreaterEqual(report["convergence"]["worst_mean_ratios"][-1], target)
        self.assertLess(report["convergence"]["iteration_count"],
                        whole["convergence"]["iteration_count"])

    def test_movement_limit_is_a_length_or_a_share_of_the_diagonal(self):
        mesh = self.generate("in.vtk")
        before = struct.unpack(">6000d", read_vtk_points(mesh))
        farthest = {}
        for limit in ("1e9", "1%", "0.02"):
            _, report = self.smooth(mesh, "--movement-limit", limit, output="out.vtk")
            after = struct.unpack(">6000d", read_vtk_points(self.path("out.vtk")))
            farthest[limit] = max(math.dist(before[i:i + 3], after[i:i + 3])
                                  for i in range(0, len(before), 3))
            self.assertEqual(report["quality_after"]["inverted_element_count"], "0")
        diagonal = report["convergence"]["bounding_box_diagonal"]
        for limit, length in (("1%", 0.01 * diagonal), ("0.02", 0.02)):
            self.assertGreater(farthest["1e9"], 1.5 * length)
            self.assertLessEqual(farthest[limit], length * (1 + 1e-12))
            self.assertGreater(farthest[limit], 0.9 * length)

    def test_tangled_mesh_is_untangled_or_refused(self):
        mesh = self.generate("in.vtu", tangle=0.3)

        result, report = self.smooth(mesh)

        self.assertGreater(int(report["quality_before"]["inverted_element_count"]), 100)
        self.assertEqual(report["quality_after"]["inverted_element_count"], "0")
        self.assertIn("no element is inverted any more", result.stdout)
        volumes = [report[when]["sum_absolute_volume"] - report[when]["enclosed_volume"]
                   for when in ("quality_before", "quality_after")]
        self.assertGreater(volumes[0], 0.01)
        self.assertAlmostEqual(volumes[1], 0, places=12)
        error = self.error_of("smooth", mesh, "-o", self.path("out.vtu"), "--tangled", "refuse",
                              exit_code=BAD_MESH)
        self.assertIn("MESH_TANGLED", error)

    def test_report_has_the_whole_summary(self):
        result, report = self.smooth(self.generate("in.vtu"), "--history")

        for when in ("quality_before", "quality_after"):
            metrics = {m["metric"].removeprefix("QUALITY_METRIC_"): m
                       for m in report[when]["metrics"]}
            self.assertEqual(set(metrics), {"MEAN_RATIO", "SCALED_JACOBIAN", "RADIUS_RATIO",
                                            "MIN_DIHEDRAL_ANGLE", "MAX_DIHEDRAL_ANGLE"})
            for m in metrics.values():
                self.assertEqual(sum(map(int, m["histogram"])), int(m["element_count"]))
                self.assertTrue(m["min"] <= m["percentile_1"] <= m["mean"] <= m["max"])
            self.assertAlmostEqual(report[when]["enclosed_volume"],
                                   report[when]["sum_absolute_volume"], places=12)
        self.assertRegex(result.stdout,
                         r"volume: the elements fill (\S+), the boundary encloses \1")
        convergence = report["convergence"]
        energies = convergence["energies"]
        self.assertEqual(energies, sorted(energies, reverse=True))
        self.assertGreater(energies[0], energies[-1])
        for history in ("energies", "worst_mean_ratios", "moved_node_counts",
                        "max_displacements"):
            self.assertEqual(len(convergence[history]), convergence["iteration_count"])
        locked = report["locked"]
        self.assertGreater(int(locked["element_count"]), 0)
        self.assertIn(f"the worst, element {locked['worst_element']['element']}, has mean ratio "
                      f"{locked['worst_element']['mean_ratio']:.4f}", result.stdout)

    def test_history_of_every_method_tells_energy_and_worst_element(self):
        mesh = self.generate("in.vtu")
        for method in ("laplacian", "smart-laplacian", "taubin", "hc-laplacian",
                       "windowed-sinc"):
            with self.subTest(method=method):
                _, report = self.smooth(mesh, "--method", method, "--history",
                                        "--iterations", "10", "--never-worse", "off")
                convergence = report["convergence"]
                for history in ("energies", "worst_mean_ratios"):
                    self.assertEqual(len(convergence[history]), convergence["iteration_count"])
                # The guard of windowed-sinc acts on the sum of its terms, at the end.
                guarded = convergence["energies"][-1:] if method == "windowed-sinc" \
                    else convergence["energies"]
                self.assertTrue(all(1 < e < math.inf for e in guarded))
                self.assertAlmostEqual(min(convergence["worst_mean_ratios"][-1],
                                           report["locked"]["worst_element"]["mean_ratio"]),
                                       mean_ratio(report, "quality_after")["min"], places=12)

    def test_history_is_left_out_unless_asked_for(self):
        _, report = self.smooth(self.generate("in.vtu"))

        self.assertGreater(report["convergence"]["iteration_count"], 0)
        self.assertEqual(report["convergence"]["energies"], [])

    def test_smart_laplacian_leaves_a_valid_mesh_valid(self):
        result, report = self.smooth(self.generate("in.vtu"), "--method", "smart-laplacian")

        self.assertIn("no element is inverted", result.stdout)
        self.assertEqual(report["quality_before"]["inverted_element_count"], "0")
        self.assertEqual(report["quality_after"]["inverted_element_count"], "0")
        self.assertEqual(report["stop_reason"], "STOP_REASON_CONVERGED")
        self.assertEqual(report["nodes"]["total"], "2000")
        self.assertIn("smart_laplacian", report["options"])
        self.assertGreater(report["quality_after"]["metrics"][0]["mean"],
                           report["quality_before"]["metrics"][0]["mean"])

    def test_plain_laplacian_says_plainly_what_it_inverts(self):
        result, report = self.smooth(self.generate("in.vtu", nodes=20000), "--method", "laplacian",
                                     "--guard", "off")

        inverted = int(report["quality_after"]["inverted_element_count"])
        total = int(report["quality_after"]["element_count"])
        self.assertTrue(0.01 < inverted / total < 0.025, inverted / total)
        self.assertIn(f"{inverted:,} of {total:,} elements ({100 * inverted / total:.1f} %) are "
                      "inverted; they were valid before: plain laplacian without the guard does "
                      "this", result.stdout)

    def test_every_method_runs(self):
        volume = self.generate("in.vtu")
        surface = self.generate("square.vtu", shape="square")
        for mesh in (volume, surface):
            for method in ("laplacian", "weighted-laplacian", "smart-laplacian", "taubin",
                           "hc-laplacian", "windowed-sinc", "optimize"):
                with self.subTest(mesh=mesh, method=method):
                    _, report = self.smooth(mesh, "--method", method, "--iterations", "20")
                    self.assertEqual(report["quality_after"]["inverted_element_count"], "0")

    def test_mixed_elements_go_through(self):
        result, report = self.smooth(self.generate("in.vtu", shape="mixed"))

        self.assertEqual(report["quality_after"]["inverted_element_count"], "0")
        self.assertIn("no element is inverted", result.stdout)

    def test_fixed_nodes_come_back_bit_identical(self):
        mesh = self.generate("in.vtk")
        (self.folder / "fixed.txt").write_text("1990\n1999 # the last\n")

        _, report = self.smooth(mesh, "--fixed-nodes", self.path("fixed.txt"), output="out.vtk")

        before, after = read_vtk_points(mesh), read_vtk_points(self.path("out.vtk"))
        moved = sum(before[i:i + 24] != after[i:i + 24] for i in range(0, len(before), 24))
        self.assertEqual(moved, int(report["nodes"]["moved"]))
        self.assertGreater(moved, 100)
        for node in (1990, 1999):
            self.assertEqual(before[24 * node:24 * node + 24], after[24 * node:24 * node + 24])

    def halves(self, name, array="part"):
        """A cube of 5 x 5 x 5 cells, noisy inside, whose cells left of the plane x = 2 are of
        another part; its path, and the nodes inside that are between the parts."""
        n = 6
        shake = random.Random(5)
        def place(i):
            inside = 0 < i[0] < n - 1 and 0 < i[1] < n - 1 and 0 < i[2] < n - 1
            return tuple(c + shake.uniform(-0.2, 0.2) * (inside and (axis > 0 or c != 2))
                         for axis, c in enumerate(i))
        lattice = [(x, y, z) for z in range(n) for y in range(n) for x in range(n)]
        number = {i: k for k, i in enumerate(lattice)}
        corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
                   (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        cells = [i for i in lattice if max(i) < n - 1]
        text = vtk_text([place(i) for i in lattice],
                        [[number[tuple(map(sum, zip(i, c)))] for c in corners] for i in cells], 12)
        text += f"CELL_DATA {len(cells)}\nSCALARS {array} int 1\nLOOKUP_TABLE default\n"
        text += " ".join("8" if i[0] < 2 else "-3" for i in cells) + "\n"
        held = [i[0] == 2 and 0 < i[1] < n - 1 and 0 < i[2] < n - 1 for i in lattice]
        text += f"POINT_DATA {n**3}\nSCALARS middle int 1\nLOOKUP_TABLE default\n"
        text += " ".join(str(int(h)) for h in held) + "\n"
        Path(self.path(name)).write_text(text)
        return self.path(name), [k for k, h in enumerate(held) if h]

    def moved_nodes(self, mesh, *arguments):
        """Smooths; the nodes that moved, the report and what was printed."""
        start = self.path("start.vtk")
        self.run_cli("smooth", mesh, "-o", start, "--iterations", "0", "--quiet")
        result, report = self.smooth(mesh, *arguments, output="out.vtk")
        before, after = read_vtk_points(start), read_vtk_points(self.path("out.vtk"))
        return {k for k in range(len(before) // 24)
                if before[24 * k:24 * k + 24] != after[24 * k:24 * k + 24]}, report, result.stdout

    def test_interfaces_of_the_regions_named_are_kept(self):
        mesh, between = self.halves("in.vtk")

        free, report, _ = self.moved_nodes(mesh)
        self.assertEqual(len(free), 64)
        self.assertEqual(report["nodes"]["between_regions"], "0")
        for server in (False, True):
            with contextlib.ExitStack() as stack:
                where = ["--server", stack.enter_context(ServerProgram()).address] * server
                held, report, output = self.moved_nodes(mesh, "--regions", "part", *where)
                self.assertEqual(free - held, set(between))
                self.assertEqual(report["nodes"]["between_regions"], "36")
                self.assertIn("2 regions by part, 36 nodes between them\n", output)

    def test_shells_that_meet_at_an_edge_keep_it(self):
        points = [(x + (0.2 if (x, y) in ((1, 1), (2, 3)) else 0), y, 0)
                  for y in range(5) for x in range(5)]
        points += [(x, 2, z) for z in (1, 2) for x in range(5)]
        rows = [[5 * y + x for x in range(5)] for y in range(5)]
        web = [rows[2], *([25 + 5 * z + x for x in range(5)] for z in range(2))]
        cells = [(low[x], low[x + 1], high[x + 1], high[x]) for sheet in (rows, web)
                 for low, high in zip(sheet, sheet[1:]) for x in range(4)]
        (self.folder / "in.vtk").write_text(vtk_text(points, cells, cell_type=9))
        for method in ("optimize", "smart-laplacian", "taubin", "windowed-sinc"):
            with self.subTest(method=method):
                moved, report, output = self.moved_nodes(self.path("in.vtk"), "--method", method)
                self.assertIn("5 on non-manifold edges (of three or more elements)", output)
                self.assertEqual(report["nodes"]["on_non_manifold_edges"], "5")
                self.assertIn(rows[1][1], moved)
                self.assertFalse(moved & set(rows[2]))

    def test_collapsed_and_interface_elements_are_read_as_what_they_are(self):
        def at(x, y, z):
            return 16 * z + 4 * y + x

        points = [(x + 0.1 * (x * y * z % 3), y, z)
                  for z in (0, 1, 2, 2, 3) for y in range(4) for x in range(4)]
        cubes = [[at(x, y, z), at(x + 1, y, z), at(x + 1, y + 1, z), at(x, y + 1, z),
                  at(x, y, z + 1), at(x + 1, y, z + 1), at(x + 1, y + 1, z + 1), at(x, y + 1, z + 1)]
                 for z in range(4) for y in range(3) for x in range(3)]
        # Of two layers, halves that repeat an edge; the third one has no thickness.
        halves = [half for n in cubes[:18]
                  for half in ([n[0], n[1], n[2], n[2], n[4], n[5], n[6], n[6]],
                               [n[0], n[2], n[3], n[3], n[4], n[6], n[7], n[7]])]
        (self.folder / "in.vtk").write_text(vtk_text(points, halves + cubes[18:], cell_type=12))
        quality = self.run_cli("quality", self.path("in.vtk")).stdout
        for server in (False, True):
            with contextlib.ExitStack() as stack:
                where = ["--server", stack.enter_context(ServerProgram()).address] * server
                moved, report, output = self.moved_nodes(self.path("in.vtk"), "--never-worse", "off",
                                                         *where)
            for text in (quality, output):
                self.assertIn("36 elements with repeated nodes: read as the type", text)
                self.assertIn("9 interface elements without thickness: not evaluated", text)
            self.assertEqual(report["quality_after"]["collapsed_element_count"], "36")
            self.assertEqual(report["quality_after"]["interface_element_count"], "9")
            self.assertIn("no element is inverted", output)
            self.assertTrue(moved)
            self.assertFalse(moved & set(range(32, 64)))

    def sheet_inside(self, dimension, simplices):
        """A cube or square of 5 cells a side, noisy, whose plane (or line) x = 2 and side y = 0 are
        cells, too; its path, and the nodes of the two."""
        n, shake = 6, random.Random(8)
        lattice = list(itertools.product(*[range(n)] * dimension))
        number = {i: k for k, i in enumerate(lattice)}

        def place(i):
            moved = [c + shake.uniform(-0.2, 0.2) * (0 < c < n - 1 and (axis > 0 or c != 2))
                     for axis, c in enumerate(i)]
            return (*moved, *[0] * (3 - dimension))

        def split(corner, axes):
            """The box at a corner along some axes as simplices, along its diagonal."""
            for order in itertools.permutations(axes):
                at = list(corner)
                chain = [number[tuple(at)]]
                for axis in order:
                    at[axis] += 1
                    chain.append(number[tuple(at)])
                yield chain

        def box(corner, axes):
            square = [(0, 0), (1, 0), (1, 1), (0, 1)]
            steps = {1: [(0,), (1,)], 2: square, 3: [(*s, z) for z in (0, 1) for s in square]}
            for step in steps[len(axes)]:
                at = list(corner)
                for axis, forward in zip(axes, step):
                    at[axis] += forward
                yield number[tuple(at)]

        def cells(corners, axes):
            for corner in corners:
                if max(corner[axis] for axis in axes) == n - 1:
                    continue
                yield from split(corner, axes) if simplices else [list(box(corner, axes))]

        axes = range(dimension)
        inner = list(cells([i for i in lattice if i[0] == 2], [a for a in axes if a != 0]))
        side = list(cells([i for i in lattice if i[1] == 0], [a for a in axes if a != 1]))
        mesh = list(cells(lattice, axes))
        types = {1: 3, 2: 5 if simplices else 9, 3: 10 if simplices else 12}
        text = vtk_text([place(i) for i in lattice], inner + side + mesh, types[dimension])
        head, _ = text.split("CELL_TYPES")
        lower = [types[dimension - 1]] * len(inner + side)
        kinds = lower + [types[dimension]] * len(mesh)
        text = f"{head}CELL_TYPES {len(kinds)}\n" + "\n".join(map(str, kinds)) + "\n"
        Path(self.path("sheet.vtk")).write_text(text)
        return (self.path("sheet.vtk"), {node for cell in inner for node in cell},
                {node for cell in side for node in cell})

    def test_surfaces_and_lines_inside_a_region_stay(self):
        for dimension, simplices in itertools.product((2, 3), (False, True)):
            for boundary in ("slide", "free"):
                with self.subTest(dimension=dimension, simplices=simplices, boundary=boundary):
                    mesh, inner, side = self.sheet_inside(dimension, simplices)
                    moved, _, output = self.moved_nodes(mesh, "--boundary", boundary,
                                                        "--iterations", "5")
                    self.assertFalse(moved & inner)
                    self.assertGreater(len(moved & side), 2)
                    self.assertIn(f"{len(inner)} nodes of surfaces, lines and points inside the "
                                  "mesh stay", output)

    def test_a_mesh_that_cannot_move_says_why(self):
        corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
        grid = list(itertools.product(range(4), repeat=2))
        points = [(x + u, y + v, (x + u) * (y + v)) for x, y in grid for u, v in corners]
        cells = [range(4 * k, 4 * k + 4) for k in range(len(grid))]
        flat = {corner: k for k, corner in enumerate(itertools.product(range(5), range(5), (0, 1)))}
        layer = [[flat[x + u, y + v, z] for z in (0, 1) for u, v in corners] for x, y in grid]
        for why, text in (
                ("64 nodes are at 25 positions: --merge-coincident smooths them as one",
                 vtk_text(points, cells, 9)),
                ("50 nodes on the boundary, as in a mesh of one layer of elements, where "
                 "--boundary slide lets them move", vtk_text(list(flat), layer, 12))):
            with self.subTest(why=why):
                Path(self.path("in.vtk")).write_text(text)
                result, _ = self.smooth(self.path("in.vtk"), output="out.vtk")
                self.assertIn(f"no node can move: all are fixed; {why}\n", result.stdout)
        result, _ = self.smooth(self.path("in.vtk"), "--boundary", "slide", output="out.vtk")
        self.assertNotIn("no node can move", result.stdout)

    def test_nodes_between_regions_slide_in_the_interface(self):
        mesh, between = self.halves("in.vtk")

        moved, report, _ = self.moved_nodes(mesh, "--regions", "part", "--boundary", "slide")

        self.assertEqual(report["nodes"]["between_regions"], "36")
        self.assertGreater(len(moved & set(between)), 10)
        after = struct.unpack(f">{3 * 216}d", read_vtk_points(self.path("out.vtk")))
        self.assertEqual({after[3 * node] for node in between}, {2.0})

    def test_regions_that_a_converter_named_are_kept_by_default(self):
        mesh, between = self.halves("in.vtk", array="gmsh:physical")

        held, _, output = self.moved_nodes(mesh)
        free, report, quiet = self.moved_nodes(mesh, "--regions", "none")

        self.assertEqual(free - held, set(between))
        self.assertIn("2 regions by gmsh:physical", output)
        self.assertEqual(report["nodes"]["between_regions"], "0")
        self.assertNotIn("regions by", quiet)
        with self.subTest("as Gmsh's own file"):
            self.run_cli("smooth", mesh, "-o", self.path("in.msh"), "--iterations", "0")
            result = self.run_cli("smooth", self.path("in.msh"), "-o", self.path("out.msh"))
            self.assertIn("2 regions by gmsh:physical, 36 nodes between them\n", result.stdout)
        with self.subTest("a free boundary frees interfaces too"):
            free, _, _ = self.moved_nodes(mesh, "--boundary", "free", "--iterations", "3")
            self.assertTrue(set(between) <= free)
            error = self.error_of("smooth", mesh, "-o", self.path("out.vtk"), "--boundary", "free",
                                  "--regions", "gmsh:physical", exit_code=USAGE)
            self.assertIn("OPTION_MISPLACED", error)

    def test_named_sets_of_nodes_are_held(self):
        mesh, middle = self.halves("in.vtk", array="gmsh:geometrical")

        free, _, _ = self.moved_nodes(mesh, "--regions", "none")
        held, _, _ = self.moved_nodes(mesh, "--regions", "none", "--fixed-set", "middle",
                                      "--fixed-set", "middle")

        self.assertEqual(free - held, set(middle))

    def test_unknown_names_are_answered_by_those_that_there_are(self):
        mesh, _ = self.halves("in.vtk")
        for flag, known in (("--fixed-set", "middle"), ("--regions", "part")):
            error = self.error_of("smooth", mesh, "-o", self.path("out.vtk"), flag, "nobody",
                                  exit_code=USAGE)
            self.assertIn(f'"nobody"; there are: {known} (NAME_UNKNOWN)', error)
        self.assertEqual(self.files(), ["in.vtk"])

    def test_precision_f32_writes_floats(self):
        mesh = self.generate("in.vtk")

        self.smooth(mesh, "--precision", "f32", output="out.vtk")

        self.assertRegex(Path(self.path("out.vtk")).read_bytes(), rb"POINTS 2000 float")
        before = struct.unpack(">6000d", read_vtk_points(mesh))
        after = struct.unpack(">6000f", read_vtk_points(self.path("out.vtk")))
        self.assertEqual(sum(abs(a - b) > 1 for a, b in zip(before, after)), 0)

    def test_same_request_same_bytes(self):
        mesh = self.generate("in.vtu")
        for name in ("first.vtu", "second.vtu"):
            self.run_cli("smooth", mesh, "-o", self.path(name))
        self.assertEqual(Path(self.path("first.vtu")).read_bytes(),
                         Path(self.path("second.vtu")).read_bytes())

    def test_input_can_be_its_own_output(self):
        mesh = self.generate("in.vtu")
        before = Path(mesh).read_bytes()

        self.run_cli("smooth", mesh, "-o", mesh)

        self.assertNotEqual(Path(mesh).read_bytes(), before)
        self.assertEqual(self.files(), ["in.vtu"])
        self.run_cli("quality", mesh)

    def test_surface_elements_of_a_volume_mesh_are_kept_and_hold_their_nodes(self):
        # Only node 6 can move, unless a triangle holds it.
        mesh = self.folder / "in.mesh"
        points = [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1),
                  (0.2, 0.1, -0.15)]
        cells = [c for n in range(4)
                 for c in ((6, n, (n + 1) % 4, 4), (6, (n + 1) % 4, n, 5))]
        def text(triangles):
            parts = ["MeshVersionFormatted 2", "Dimension 3", f"Vertices\n{len(points)}"]
            parts += [" ".join(map(str, p)) + " 0" for p in points]
            if triangles:
                parts += [f"Triangles\n{len(triangles)}"]
                parts += [" ".join(str(n + 1) for n in t) + " 7" for t in triangles]
            parts += [f"Tetrahedra\n{len(cells)}"]
            parts += [" ".join(str(n + 1) for n in c) + " 0" for c in cells]
            return "\n".join(parts + ["End", ""])

        mesh.write_text(text([]))
        _, report = self.smooth(mesh, output="out.mesh")
        self.assertEqual(report["nodes"]["moved"], "1")
        mesh.write_text(text([(6, 0, 1)]))
        _, report = self.smooth(mesh, output="out.mesh")
        self.assertEqual(report["nodes"]["moved"], "0")
        self.assertRegex(Path(self.path("out.mesh")).read_text(), r"Triangles\s+1\s+7 1 2 7")

    def layer(self, name, **options):
        path = self.path(name)
        extra = [part for key, value in options.items() for part in (f"--{key}", str(value))]
        self.run_cli("generate", "layer", *extra, "-o", path)
        return path

    def test_layers_are_kept_and_come_back_to_a_reference(self):
        clean = self.layer("clean.vtk")
        jittered = self.layer("jittered.vtk", jitter=0.3)

        def least(report, when):
            return next(m["min"] for m in report[when]["metrics"]
                        if m["metric"] == "QUALITY_METRIC_SCALED_JACOBIAN")

        _, kept = self.smooth(clean)
        self.assertEqual(kept["nodes"]["moved"], "0")
        _, ideal = self.smooth(clean, "--target", "ideal", "--never-worse", "off")
        self.assertLess(least(ideal, "quality_after"), 0.5)
        _, back = self.smooth(jittered, "--reference", clean)
        self.assertEqual(back["options"]["optimize"]["target"], "TARGET_REFERENCE")
        self.assertLess(least(back, "quality_before"), 0.5)
        self.assertGreater(least(back, "quality_after"), 0.99)

    def test_references_are_refused_by_name_where_they_are_none(self):
        clean = self.layer("clean.vtk")
        other = self.generate("other.vtu")
        output = self.path("out.vtu")
        self.assertIn("is no reference of", self.error_of(
            "smooth", clean, "-o", output, "--reference", other, exit_code=BAD_MESH))
        self.assertIn("--target reference needs --reference", self.error_of(
            "smooth", clean, "-o", output, "--target", "reference", exit_code=USAGE))
        self.assertIn("leave out one of them", self.error_of(
            "smooth", clean, "-o", output, "--target", "ideal", "--reference", clean,
            exit_code=REFUSED))
        self.assertIn("only optimize has a reference", self.error_of(
            "smooth", clean, "-o", output, "--method", "laplacian", "--reference", clean,
            exit_code=REFUSED))

    def test_nodes_of_types_and_of_good_elements_are_held(self):
        mesh = self.generate("in.vtu", shape="mixed")
        _, free = self.smooth(mesh)
        _, held = self.smooth(mesh, "--fixed-types", "hexahedron,wedge")
        self.assertLess(int(held["nodes"]["moved"]), int(free["nodes"]["moved"]))
        _, some = self.smooth(mesh, "--only-below", 0.3, "--only-below-rings", 0)
        self.assertGreater(int(some["nodes"]["outside_only_below"]), 0)
        self.assertLess(int(some["nodes"]["moved"]), int(free["nodes"]["moved"]))
        _, stays = self.smooth(mesh, "--stay", 100)
        self.assertLess(stays["convergence"]["last_max_displacement"],
                        free["convergence"]["bounding_box_diagonal"])

    def test_quiet_prints_nothing(self):
        result = self.run_cli("smooth", self.generate("in.vtu"), "-o", self.path("out.vtu"),
                              "--quiet")
        self.assertEqual(result.stdout + result.stderr, "")

    def test_summary_and_plain_progress_lines(self):
        result, _ = self.smooth(self.generate("in.vtu"))
        self.assertRegex(result.stdout, r"converged after \d+ iterations")
        self.assertRegex(result.stdout, r"mean ratio +min +0\.\d+ +0\.\d+")
        self.assertRegex(result.stdout, r"time .*iterate .*cpu")
        self.assertNotIn("\r", result.stderr)

    def test_ctrl_c_stops_and_writes_nothing(self):
        job = self.start_long_job(self.generate("in.vtu", nodes=20000), self.path("out.vtu"))

        interrupt(job)

        code, errors = job.end()
        self.assertEqual(code, STOPPED)
        self.assertIn("meshsmooth: cancelled", errors)
        self.assertEqual(self.files(), ["in.vtu"])

    def test_deadline_stops_and_compute_budget_gives_the_result_reached(self):
        mesh = self.generate("in.vtu", nodes=20000)
        error = self.error_of("smooth", mesh, "-o", self.path("out.vtu"), *LONG,
                              "--timeout", "0.3", exit_code=STOPPED)
        self.assertRegex(error, "DEADLINE|did not end within its 0.3 s")
        self.assertEqual(self.files(), ["in.vtu"])
        result, report = self.smooth(mesh, *LONG, "--compute-budget", "0.3")
        self.assertEqual(report["stop_reason"], "STOP_REASON_COMPUTE_BUDGET")
        self.assertIn("when the compute budget was used up", result.stdout)


class Quality(CliTest):
    def test_table_and_json_agree(self):
        mesh = self.generate("in.vtu")

        table = self.run_cli("quality", mesh).stdout
        stats = json.loads(self.run_cli("quality", mesh, "--json").stdout)

        mean_ratio = next(m for m in stats["metrics"]
                          if m["metric"] == "QUALITY_METRIC_MEAN_RATIO")
        row = re.search(r"mean ratio +(\S+) +(\S+) +(\S+) +(\S+) ", table)
        self.assertEqual(row.groups(),
                         tuple(f"{mean_ratio[key]:.4f}"
                               for key in ("min", "percentile_1", "mean", "max")))
        self.assertIn(f"{int(stats['element_count']):,} elements", table)
        self.assertIn("inverted 0 (0.0 %)", table)
        self.assertIn(f"{stats['worst_elements'][0]['element']} tetrahedron", table)

    def test_report_of_smooth_agrees_with_quality_of_the_output(self):
        report = self.path("report.json")
        self.run_cli("smooth", self.generate("in.vtu"), "-o", self.path("out.vtu"),
                     "--report", report)

        reported = json.loads(Path(report).read_text())["quality_after"]
        evaluated = json.loads(self.run_cli("quality", self.path("out.vtu"), "--json").stdout)
        for a, b in zip(reported["metrics"], evaluated["metrics"], strict=True):
            # A sum depends on the order, and the server has its own.
            self.assertAlmostEqual(a.pop("mean"), b.pop("mean"), places=10)
            self.assertEqual(a, b)
        self.assertEqual(reported["worst_elements"], evaluated["worst_elements"])


class WithServer(CliTest):
    def test_embedded_and_separate_server_give_equal_bytes(self):
        with ServerProgram() as server:
            for name, shape in (("in.vtu", "cube"), ("in.msh", "mixed"), ("in.mesh", "cube"),
                                ("in.ele", "slope")):
                with self.subTest(name=name):
                    mesh = self.generate(name, shape=shape)
                    suffix = Path(name).suffix
                    for output, where in (("embedded", []), ("remote", ["--server",
                                                                        server.address])):
                        self.run_cli("smooth", mesh, "-o", self.path(output + suffix), *where)
                    endings = [".ele", ".node"] if suffix == ".ele" else [suffix]
                    for ending in endings:
                        self.assertEqual(Path(self.path("embedded" + ending)).read_bytes(),
                                         Path(self.path("remote" + ending)).read_bytes())

    def test_info_health_and_jobs(self):
        with ServerProgram() as server:
            at = ["--server", server.address]
            self.assertIn("optimize", self.run_cli("info", *at).stdout)
            self.assertIn("limits", json.loads(self.run_cli("info", "--json", *at).stdout))
            self.assertEqual(self.run_cli("health", *at).stdout, "SERVING\n")
            self.assertEqual(self.run_cli("jobs", *at).stdout, "no jobs\n")
            request_id = "10c5bb5e-86b9-4ddf-b183-6bc4a7a12a3b"
            self.run_cli("smooth", self.generate("in.vtu"), "-o", self.path("out.vtu"), *at,
                         "--request-id", request_id)
            self.assertRegex(self.run_cli("jobs", *at).stdout, r"jobs/\S+ +succeeded +2,000 ")
            jobs = json.loads(self.run_cli("jobs", "--json", *at).stdout)
            self.assertEqual([job["request_id"] for job in jobs], [request_id])

    def test_killed_server_in_mid_job(self):
        mesh = self.generate("in.vtu", nodes=20000)
        with ServerProgram() as server:
            job = self.start_long_job(mesh, self.path("out.vtu"), "--server", server.address)

            server.kill()

            code, errors = job.end()
        self.assertEqual(code, REFUSED)
        last_line = errors.strip().splitlines()[-1]
        self.assertIn("broke while the job was under way", last_line)
        self.assertIn(server.address, last_line)
        self.assertEqual(self.files(), ["in.vtu"])

    def test_server_that_drains_refuses_with_its_reason(self):
        mesh = self.generate("in.vtu", nodes=20000)
        with ServerProgram() as server:
            job = self.start_long_job(mesh, self.path("out.vtu"), "--server", server.address)

            server.process.terminate()

            code, errors = job.end()
            self.assertEqual(server.end()[0], DONE)
        self.assertIn(code, (REFUSED, STOPPED))
        self.assertRegex(errors.strip().splitlines()[-1], r"\([A-Z_]+\)")

    def test_cancel_with_and_without_the_result(self):
        mesh = self.generate("in.vtu", nodes=20000)
        with ServerProgram() as server:
            at = ["--server", server.address]
            for keep, exit_code in ((["--keep-result"], DONE), ([], STOPPED)):
                with self.subTest(keep=keep):
                    job = self.start_long_job(mesh, self.path("out.vtu"), *at)
                    jobs = json.loads(self.run_cli("jobs", "--json", *at).stdout)
                    name = next(j["name"] for j in jobs if j["state"] == "STATE_RUNNING")
                    self.run_cli("cancel", name.removeprefix("jobs/"), *at, *keep)
                    self.assertEqual(job.end()[0], exit_code)
                    self.assertEqual(self.files(), ["in.vtu"] + ["out.vtu"] * bool(keep))
                    Path(self.path("out.vtu")).unlink(missing_ok=True)
            error = self.error_of("cancel", "nobody", *at, exit_code=1)
            self.assertIn("JOB_NOT_FOUND", error)

    def test_attach_writes_the_result_of_a_kept_job(self):
        mesh = self.generate("in.vtu")
        with ServerProgram() as server:
            at = ["--server", server.address]
            self.run_cli("smooth", mesh, "-o", self.path("smoothed.vtu"), *at,
                         "--result-ttl", "600")
            name = json.loads(self.run_cli("jobs", "--json", *at).stdout)[0]["name"]
            for job in (name, name.removeprefix("jobs/")):
                attached = self.run_cli("attach", job, mesh, "-o", self.path("attached.vtu"), *at,
                                        "--report", self.path("report.json"))
                self.assertIn("converged", attached.stdout)
                self.assertEqual(Path(self.path("attached.vtu")).read_bytes(),
                                 Path(self.path("smoothed.vtu")).read_bytes())
            report = json.loads((self.folder / "report.json").read_text())
            self.assertIn("optimize", report["options"])
            error = self.error_of("attach", "nobody", mesh, "-o", self.path("none.vtu"), *at,
                                  exit_code=1)
            self.assertIn("JOB_NOT_FOUND", error)
        self.assertNotIn("none.vtu", self.files())

    def test_mesh_beyond_the_servers_limit_is_refused(self):
        with ServerProgram("--max-node-count", "1000") as server:
            error = self.error_of("smooth", self.generate("in.vtu"), "-o", self.path("out.vtu"),
                                  "--server", server.address, exit_code=REFUSED)
        self.assertIn("MESH_TOO_LARGE", error)
        self.assertIn("1000", error)


if __name__ == "__main__":
    main()
