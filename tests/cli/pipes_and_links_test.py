"""Files as such: compressed ones, pipes, formats that are named, links, permissions, full disks."""

import gzip
import os
import resource
import shutil
import subprocess
import threading
from pathlib import Path

from programs import CLI, DONE, FAILED, USAGE, CliTest, main

FIXTURES = Path(__file__).parent.parent / "formats" / "files"
SLOW_IS_FINE = 120
# Nodes of all meshes move.
ITERATIONS = ["--iterations", "2", "--method", "laplacian", "--boundary", "free",
              "--never-worse", "off"]


class FileTest(CliTest):
    def setUp(self):
        super().setUp()
        self.temporary = self.folder / "temporary"
        self.temporary.mkdir()

    def run_bytes(self, *arguments, stdin=b"", exit_code=DONE, **options):
        """Runs the program on bytes; it must leave no temporary file."""
        environment = dict(os.environ, TMPDIR=str(self.temporary))
        result = subprocess.run([CLI, *map(str, arguments)], input=stdin, timeout=SLOW_IS_FINE,
                                stdout=options.pop("stdout", subprocess.PIPE),
                                stderr=subprocess.PIPE, env=environment, **options)
        self.assertEqual(result.returncode, exit_code, result.stderr.decode())
        self.assertEqual(list(self.temporary.iterdir()), [])
        return result

    def fixture(self, name, as_name=None):
        path = self.folder / (as_name or name)
        shutil.copyfile(FIXTURES / name, path)
        return path

    def smoothed(self, mesh, name):
        """What smoothing the mesh into a file gives."""
        self.run_bytes("smooth", mesh, "-o", self.path(name), *ITERATIONS, "--quiet")
        return (self.folder / name).read_bytes()

    def names(self):
        return [name for name in self.files() if name != "temporary"]


class Pipes(FileTest):
    def test_standard_input_to_standard_output(self):
        files = [self.generate(f"in.{name}", shape="square", nodes=120)
                 for name in ("vtu", "msh")]
        files += [self.fixture(name) for name in ("deck.inp", "assembly.exo")]
        for mesh in map(Path, files):
            with self.subTest(mesh=mesh.name):
                expected = self.smoothed(mesh, "expected" + mesh.suffix)
                result = self.run_bytes("smooth", "-", "--format", mesh.suffix[1:], "-o", "-",
                                        *ITERATIONS, stdin=mesh.read_bytes())
                self.assertEqual(result.stdout, expected)
                self.assertIn(b"inverted", result.stderr)  # the tables went there

    def test_names_of_standard_streams(self):
        mesh = self.fixture("deck.inp")
        expected = self.smoothed(mesh, "expected.inp")
        result = self.run_bytes("smooth", "/dev/stdin", "--format", ".INP", "-o", "/dev/stdout",
                                *ITERATIONS, stdin=mesh.read_bytes())
        self.assertEqual(result.stdout, expected)
        with (self.folder / "redirected").open("wb") as file:
            self.run_bytes("smooth", mesh, "-o", "/dev/stdout", *ITERATIONS, stdout=file)
        self.assertEqual((self.folder / "redirected").read_bytes(), expected)

    def test_open_files_as_of_process_substitution(self):
        mesh = self.fixture("mixed.su2")
        expected = self.smoothed(mesh, "expected.su2")
        read, write = os.pipe()
        read_back, write_back = os.pipe()
        received = []
        threads = [threading.Thread(target=lambda: Path(f"/dev/fd/{write}").write_bytes(
            mesh.read_bytes())), threading.Thread(target=lambda: received.append(
                open(read_back, "rb", closefd=False).read()))]
        with subprocess.Popen([CLI, "smooth", f"/dev/fd/{read}", "--format", "su2", "-o",
                               f"/dev/fd/{write_back}", *ITERATIONS], pass_fds=(read, write_back),
                              stdout=subprocess.DEVNULL) as process:
            threads[0].start()
            threads[1].start()
            threads[0].join()
            os.close(write)
            os.close(write_back)
            self.assertEqual(process.wait(SLOW_IS_FINE), DONE)
        threads[1].join()
        os.close(read)
        os.close(read_back)
        self.assertEqual(received, [expected])

    def test_quality_and_compare_read_standard_input(self):
        mesh = self.fixture("mixed.su2")
        result = self.run_bytes("quality", "-", "--format", "su2", "--require", "inverted == 0",
                                stdin=mesh.read_bytes())
        self.assertIn(b"met ", result.stdout)
        for arguments in (["-", mesh, "--format", "su2"], [mesh, "-", "--format", "su2"]):
            result = self.run_bytes("compare", *arguments, stdin=mesh.read_bytes())
            self.assertIn(b"all bytes are equal", result.stdout)

    def test_a_table_on_standard_output_is_alone_there(self):
        mesh = self.fixture("mixed.su2")
        result = self.run_bytes("quality", mesh, "--csv", "-")
        self.assertTrue(result.stdout.startswith(b"id,type,x,y,z,state"))
        self.assertNotIn(b"inverted", result.stdout)
        self.assertIn(b"inverted", result.stderr)

    def test_a_generated_mesh_goes_to_standard_output_in_its_format(self):
        result = self.run_bytes("generate", "square", "--nodes", 60, "-o", "-",
                                "--output-format", "obj")
        self.assertTrue(result.stdout.startswith(b"v "), result.stdout[:40])
        self.run_bytes("generate", "square", "--nodes", 60, "-o", "-", exit_code=USAGE)

    def test_what_makes_no_sense_is_refused(self):
        mesh = self.fixture("mixed.su2")
        pair = self.fixture("tetgen.node")
        self.fixture("tetgen.ele")
        for arguments, text in (
                (["compare", "-", "-", "--format", "su2"], b"standard input, which is read once"),
                (["smooth", mesh, "-o", "-", "--report", "-"], b"name the same file"),
                (["quality", mesh, "--csv", "-", "--npz", "/dev/stdout"],
                 b"both name standard output"),
                (["quality", "-"], b"its name does not tell its format"),
                (["quality", "-", "--format", "node"], b"so a pipe cannot carry them"),
                (["smooth", pair, "-o", "-"], b"so a pipe cannot carry them"),
                (["quality", mesh, "--format", "docx"], b"docx is not one of")):
            with self.subTest(arguments=arguments):
                result = self.run_bytes(*arguments, stdin=mesh.read_bytes(), exit_code=USAGE)
                self.assertIn(text, result.stderr)
                self.assertEqual(result.stdout, b"")

    def test_errors_say_standard_input(self):
        for name, text in (("vtk", b"no mesh"), ("inp", b"*NODE\n1, x\n"), ("msh", b"")):
            with self.subTest(name=name):
                result = self.run_bytes("quality", "-", "--format", name, stdin=text, exit_code=3)
                self.assertIn(b"meshsmooth: standard input: ", result.stderr)

    def test_a_pipe_that_nobody_reads(self):
        mesh = self.generate("in.ply", shape="square", nodes=5000)
        read, write = os.pipe()
        os.close(read)
        result = self.run_bytes("smooth", mesh, "-o", "-", "--iterations", "0", stdout=write,
                                exit_code=FAILED)
        os.close(write)
        self.assertIn(b"standard output: Broken pipe", result.stderr)

    def test_a_full_standard_output(self):
        mesh = self.fixture("mixed.su2")
        with open("/dev/full", "wb") as full:
            result = self.run_bytes("quality", mesh, stdout=full, exit_code=FAILED)
            self.assertIn(b"FILE_NOT_WRITABLE", result.stderr)
            self.run_bytes("smooth", mesh, "-o", "-", *ITERATIONS, stdout=full, exit_code=FAILED)


class Names(FileTest):
    def test_a_named_format(self):
        mesh = self.fixture("deck.inp", "deck.dat")
        expected = self.smoothed(self.fixture("deck.inp"), "expected.inp")
        self.run_bytes("smooth", mesh, "--format", "inp", "-o", self.path("out.dat"), *ITERATIONS)
        self.assertEqual((self.folder / "out.dat").read_bytes(), expected)
        result = self.run_bytes("compare", mesh, self.path("out.dat"), "--format", "inp")
        self.assertNotIn(b"none of", result.stdout)
        self.run_bytes("smooth", mesh, "--format", "inp", "-o", self.path("out.txt"),
                       "--output-format", "vtu", *ITERATIONS)
        self.assertIn(b"<VTKFile", (self.folder / "out.txt").read_bytes())
        self.run_bytes("quality", mesh, exit_code=USAGE)

    def test_a_conversion_into_capitals(self):
        mesh = self.generate("in.vtu", nodes=100)
        for name in ("OUT.MSH", "OUT.VTK"):
            with self.subTest(name=name):
                self.run_bytes("smooth", mesh, "-o", self.path(name), *ITERATIONS)
                self.run_bytes("quality", self.path(name))


class Compressed(FileTest):
    def test_files_are_read_and_written(self):
        files = [self.generate("in.vtu", nodes=100), self.fixture("deck.inp")]
        for mesh in map(Path, files):
            with self.subTest(mesh=mesh.name):
                expected = self.smoothed(mesh, "expected" + mesh.suffix)
                packed = self.folder / (mesh.name + ".gz")
                packed.write_bytes(gzip.compress(mesh.read_bytes()))
                out = self.folder / ("out" + mesh.suffix + ".gz")
                self.run_bytes("smooth", packed, "-o", out, *ITERATIONS)
                self.assertEqual(gzip.decompress(out.read_bytes()), expected)
                result = self.run_bytes("compare", packed, out)
                self.assertNotIn(b"none of", result.stdout)
                result = self.run_bytes("compare", mesh, packed)
                self.assertIn(b"none of", result.stdout)

    def test_through_a_pipe(self):
        mesh = self.fixture("deck.inp")
        expected = self.smoothed(mesh, "expected.inp")
        result = self.run_bytes("smooth", "-", "--format", "inp", "-o", "-", *ITERATIONS,
                                stdin=gzip.compress(mesh.read_bytes()))
        self.assertEqual(result.stdout, expected)

    def test_damage_is_named(self):
        mesh = Path(self.generate("in.vtu", nodes=200))
        packed = self.folder / "in.vtu.gz"
        whole = gzip.compress(mesh.read_bytes())
        for damaged in (whole[:-1], whole[:len(whole) // 2], whole + b"x", mesh.read_bytes()):
            packed.write_bytes(damaged)
            result = self.run_bytes("quality", packed, exit_code=3)
            self.assertIn(b"in.vtu.gz: ", result.stderr)


class LinksAndPermissions(FileTest):
    def test_a_link_stays_and_leads_to_the_result(self):
        mesh = self.generate("in.vtu", nodes=100)
        (self.folder / "data").mkdir()
        (self.folder / "link.vtu").symlink_to("data/real.vtu")
        for _ in range(2):  # the second time it is there
            self.run_bytes("smooth", mesh, "-o", self.path("link.vtu"), *ITERATIONS,
                           "--report", self.path("data/report.json"))
            self.assertEqual(os.readlink(self.path("link.vtu")), "data/real.vtu")
            self.assertFalse((self.folder / "data" / "real.vtu").is_symlink())
            self.assertEqual(sorted(file.name for file in (self.folder / "data").iterdir()),
                             ["real.vtu", "report.json"])

    def test_permissions_stay(self):
        mesh = self.generate("in.vtu", nodes=100)
        for name in ("out.vtu.gz", "report.json"):
            with self.subTest(name=name):
                out = self.folder / name
                out.write_bytes(b"old")
                out.chmod(0o600)
                flag = "--html" if name == "report.json" else "-o"
                self.run_bytes("smooth" if flag == "-o" else "quality", mesh, flag, out)
                self.assertEqual(out.stat().st_mode & 0o7777, 0o600)
                self.assertNotEqual(out.read_bytes(), b"old")


class FullDisk(FileTest):
    def test_no_part_is_left(self):
        files = [self.generate("in.vtk", nodes=100), self.fixture("compressed.e")]
        for mesh in map(Path, files):
            size = len(self.smoothed(mesh, "whole" + mesh.suffix))
            out = self.folder / ("out" + mesh.suffix)
            out.write_bytes(b"old")
            before = self.files()
            for missing in (1, size // 2):
                with self.subTest(mesh=mesh.name, missing=missing, size=size):
                    self.expect_full(mesh, out, size - missing)
                    self.assertEqual(out.read_bytes(), b"old")
                    self.assertEqual(self.files(), before)

    def expect_full(self, mesh, out, limit):
        def limit_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

        result = self.run_bytes("smooth", mesh, "-o", out, *ITERATIONS, exit_code=FAILED,
                                preexec_fn=limit_files)
        self.assertIn(f"{out}: ".encode(), result.stderr)
        self.assertIn(b"FILE_NOT_WRITABLE", result.stderr)

    def test_a_report_is_whole_or_not_there(self):
        mesh = self.fixture("mixed.su2")
        result = self.run_bytes(
            "quality", mesh, "--html", self.path("report.html"), exit_code=FAILED,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000)))
        self.assertIn(b"report.html: ", result.stderr)
        self.assertEqual(self.names(), ["mixed.su2"])


if __name__ == "__main__":
    main()
