"""Every bad input has its exit code, one line that says what and where, and leaves no file."""

import socket
from pathlib import Path

from programs import (BAD_MESH, DONE, FAILED, REFUSED, USAGE, CliTest, main, vtk_text)

# A node in an octahedron: eight tetrahedra.
BALL = [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (0.2, 0.1, -0.15)]
BALL_CELLS = [cell for n in range(4)
              for cell in ((6, n, (n + 1) % 4, 4), (6, (n + 1) % 4, n, 5))]


class BadMesh(CliTest):
    def smooth_error(self, text, name="in.vtk", exit_code=BAD_MESH, arguments=()):
        (self.folder / name).write_text(text)
        error = self.error_of("smooth", self.path(name), "-o", self.path("out.vtk"), *arguments,
                              exit_code=exit_code)
        self.assertEqual(self.files(), [name])
        return error

    def test_good_mesh_is_smoothed(self):
        (self.folder / "in.vtk").write_text(vtk_text(BALL, BALL_CELLS))
        self.run_cli("smooth", self.path("in.vtk"), "-o", self.path("out.vtk"))
        self.assertEqual(self.files(), ["in.vtk", "out.vtk"])

    def test_no_elements(self):
        self.assertIn("MESH_EMPTY", self.smooth_error(vtk_text(BALL, [])))

    def test_no_nodes(self):
        self.assertIn("MESH_EMPTY", self.smooth_error(vtk_text([], [])))

    def test_repeated_node(self):
        error = self.smooth_error(vtk_text(BALL, [(6, 0, 1, 4), (6, 1, 1, 4)]))
        self.assertIn("REPEATED_NODE", error)
        self.assertIn("element 1", error)

    def test_index_out_of_range(self):
        for node in (7, -1):
            with self.subTest(node=node):
                error = self.smooth_error(vtk_text(BALL, [(6, 0, 1, 4), (6, 1, node, 4)]))
                self.assertRegex(error, "INDEX_OUT_OF_RANGE|FORMAT_ERROR")
        self.smooth_error(vtk_text(BALL, [(6, 0, 1, 4), (6, 1, 2**31, 4)]))

    def test_node_reference_of_a_tetgen_pair_that_is_not_there(self):
        nodes = "\n".join(f"{i} {x} {y} {z}" for i, (x, y, z) in enumerate(BALL))
        (self.folder / "in.node").write_text(f"7 3 0 0\n{nodes}\n")
        (self.folder / "in.ele").write_text("2 4 0\n0 6 0 1 4\n1 6 1 2 9\n")
        error = self.error_of("smooth", self.path("in.ele"), "-o", self.path("out.vtk"),
                              exit_code=BAD_MESH)
        self.assertIn("9", error)

    def test_coordinates_that_are_not_finite(self):
        for value in ("nan", "inf"):
            with self.subTest(value=value):
                faces = [(4, 0, 1), (4, 1, 2), (4, 2, 3), (4, 3, 0)]
                text = "".join(f"v {x} {y} {z}\n" for x, y, z in BALL[:4] + [(0, 0, value)])
                text += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
                error = self.smooth_error(text, name="in.obj")
                self.assertRegex(error, "NON_FINITE_COORDINATE|FORMAT_ERROR")

    def test_facet_used_three_times(self):
        points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (0, 0, 2)]
        error = self.smooth_error(vtk_text(points, [(0, 1, 2, 3), (0, 2, 1, 4), (0, 1, 2, 5)]))
        self.assertIn("FACET_OVERUSED", error)
        error = self.smooth_error(vtk_text(BALL, BALL_CELLS + [BALL_CELLS[2]]))
        self.assertIn("element 8 is in the mesh twice, as element 2", error)

    def test_isolated_nodes_are_legal_and_stay(self):
        (self.folder / "in.vtk").write_text(vtk_text(BALL + [(5.5, 5.5, 5.5)], BALL_CELLS))
        result = self.run_cli("smooth", self.path("in.vtk"), "-o", self.path("out.vtk"))
        self.assertIn("1 in no element", result.stdout)

    def test_wholly_mirrored_mesh_is_smoothed_and_keeps_its_node_order(self):
        cells = [(b, a, c, d) for a, b, c, d in BALL_CELLS]
        (self.folder / "in.vtk").write_text(vtk_text(BALL, cells))
        result = self.run_cli("smooth", self.path("in.vtk"), "-o", self.path("out.vtk"))
        self.assertIn(f"{len(cells)} elements are numbered the other way round", result.stdout)
        self.assertIn("no element is inverted", result.stdout)
        quality = self.run_cli("quality", self.path("out.vtk"))
        self.assertIn(f"{len(cells)} elements are numbered the other way round", quality.stdout)
        self.assertIn("inverted 0", quality.stdout)

    def test_tangled_mesh_is_refused_on_request(self):
        mesh = self.generate("tangled.vtu", tangle=0.05)
        error = self.error_of("smooth", mesh, "-o", self.path("out.vtu"), "--tangled", "refuse",
                              exit_code=BAD_MESH)
        self.assertIn("MESH_TANGLED", error)

    def test_quality_says_the_same_of_a_bad_mesh(self):
        (self.folder / "in.vtk").write_text(vtk_text(BALL, [(6, 0, 1, 4), (6, 1, 1, 4)]))
        error = self.error_of("quality", self.path("in.vtk"), exit_code=BAD_MESH)
        self.assertIn("REPEATED_NODE", error)


class BadFile(CliTest):
    def smooth_error(self, mesh, exit_code, output="out.vtu", arguments=()):
        return self.error_of("smooth", mesh, "-o", self.path(output), *arguments,
                             exit_code=exit_code)

    def test_file_that_is_no_mesh(self):
        for extension in ("vtu", "vtk", "vtp", "ply", "stl", "obj", "msh", "mesh", "unv", "bdf",
                          "node"):
            with self.subTest(extension=extension):
                mesh = self.folder / f"letter.{extension}"
                mesh.write_text("Dear Sir or Madam,\n\nthis is no mesh.\n")
                self.smooth_error(mesh, BAD_MESH)

    def test_unknown_extension(self):
        mesh = self.folder / "mesh.docx"
        mesh.write_text("")
        self.assertIn("FORMAT_UNKNOWN", self.smooth_error(mesh, USAGE))
        self.assertIn("FORMAT_UNKNOWN",
                      self.smooth_error(self.generate("in.vtu"), USAGE, output="out.docx"))

    def test_truncated_file(self):
        for name in ("whole.vtu", "whole.vtk", "whole.msh", "whole.mesh", "whole.ele"):
            with self.subTest(name=name):
                whole = Path(self.generate(name, nodes=500))
                cut = self.folder / f"cut{whole.suffix}"
                cut.write_bytes(whole.read_bytes()[:whole.stat().st_size * 2 // 3])
                if whole.suffix == ".ele":
                    (self.folder / "cut.node").write_bytes(
                        whole.with_suffix(".node").read_bytes())
                self.smooth_error(cut, BAD_MESH)

    def test_missing_file(self):
        self.assertIn("FILE_NOT_FOUND", self.smooth_error(self.path("none.vtu"), FAILED))

    def test_unwritable_output_is_found_before_the_work_starts(self):
        # The input is not even there: nobody looked at it.
        for output in ("none/out.vtu", "."):
            with self.subTest(output=output):
                error = self.smooth_error(self.path("none.vtu"), FAILED if output != "." else USAGE,
                                          output=output)
                self.assertNotIn("none.vtu", error)

    def test_unwritable_report_is_found_before_the_work_starts(self):
        for report in ("none/report.json", "."):
            with self.subTest(report=report):
                error = self.smooth_error(self.path("none.vtu"), FAILED,
                                          arguments=["--report", self.path(report)])
                self.assertIn("FILE_NOT_WRITABLE", error)

    def test_report_and_output_must_differ(self):
        self.smooth_error(self.path("none.vtu"), USAGE,
                          arguments=["--report", self.path("out.vtu")])

    def test_fixed_nodes_file_names_the_line(self):
        mesh = self.generate("in.vtu")
        fixed = self.folder / "fixed.txt"
        fixed.write_text("# corner\n3\n2000\n")
        error = self.smooth_error(mesh, USAGE, arguments=["--fixed-nodes", fixed])
        self.assertIn("fixed.txt:3: node 2000", error)
        self.assertNotIn("out.vtu", self.files())


class BadOption(CliTest):
    def test_unknown_words_and_values_out_of_range(self):
        mesh = self.generate("in.vtu", nodes=200)
        for arguments in (["--method", "magic"], ["--form", "magic"], ["--backend", "abacus"],
                          ["--iterations", "-1"], ["--method", "laplacian", "--relaxation", "2"],
                          ["--tolerance", "-1"], ["--tolerance", "nan"], ["--timeout", "0"],
                          ["--timeout", "soon"], ["--lambda", "0.5"], ["--goal", "best"],
                          ["--target-quality", "1"], ["--movement-limit", "0%"],
                          ["--precision", "f16"], ["--method", "taubin", "--mu", "0.5"],
                          ["--nonsense"], ["extra"]):
            with self.subTest(arguments=arguments):
                self.run_cli("smooth", mesh, "-o", self.path("out.vtu"), *arguments,
                             exit_code=USAGE)
        self.assertEqual(self.files(), ["in.vtu"])

    def test_missing_arguments(self):
        for arguments in ([], ["smooth"], ["smooth", "in.vtu"], ["quality"], ["generate", "cube"],
                          ["generate", "teapot", "-o", "t.vtu"], ["info"], ["cancel", "jobs/1"],
                          ["dance"]):
            with self.subTest(arguments=arguments):
                self.run_cli(*arguments, exit_code=USAGE)

    def test_options_of_another_method_are_named(self):
        for option, arguments in (("--goal", ["--method", "laplacian", "--goal", "worst"]),
                                  ("--target-quality", ["--method", "taubin",
                                                        "--target-quality", "0.3"]),
                                  ("--form jacobi", ["--form", "jacobi"]),
                                  ("--relaxation", ["--relaxation", "0.5"]),
                                  ("--movement-limit", ["--movement-limit", "2mm"])):
            with self.subTest(option=option):
                error = self.error_of("smooth", self.path("none.vtu"), "-o", self.path("out.vtu"),
                                      *arguments, exit_code=USAGE)
                self.assertIn(option, error)

    def test_generate_refuses_counts_that_make_no_mesh(self):
        for arguments in (["--nodes", "3"], ["--nodes", "-5"], ["--tangle", "2"]):
            with self.subTest(arguments=arguments):
                self.run_cli("generate", "cube", "-o", self.path("c.vtu"), *arguments,
                             exit_code=USAGE)

    def test_request_id_must_be_a_uuid(self):
        self.run_cli("smooth", self.generate("in.vtu", nodes=200), "-o", self.path("out.vtu"),
                     "--request-id", "me", exit_code=USAGE)

    def test_help_and_version(self):
        for arguments in (["--version"], ["--help"], ["smooth", "--help"]):
            with self.subTest(arguments=arguments):
                self.assertIn("meshsmooth", self.run_cli(*arguments, exit_code=DONE).stdout)


class NoServer(CliTest):
    def test_no_server_at_the_address(self):
        with socket.socket() as closed:
            closed.bind(("127.0.0.1", 0))
            address = f"127.0.0.1:{closed.getsockname()[1]}"
            mesh = self.generate("in.vtu", nodes=200)
            for command in (["smooth", mesh, "-o", self.path("out.vtu")], ["info"], ["jobs"],
                            ["cancel", "jobs/1"], ["health"]):
                with self.subTest(command=command):
                    error = self.error_of(*command, "--server", address, exit_code=REFUSED)
                    self.assertIn(address, error)
                    self.assertIn("no server answers", error)
        self.assertEqual(self.files(), ["in.vtu"])


if __name__ == "__main__":
    main()
