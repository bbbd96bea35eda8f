#!/usr/bin/env python3
"""scripts/tables finds files that differ from the declaration, and names what is wrong in it."""

import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent


class Tables(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        for name in ("scripts/tables.d", "proto/declaration", "docs", "core/include", "core/src/mesh", "core/src/surface"):
            shutil.copytree(ROOT / name, self.root / name, ignore=shutil.ignore_patterns("pictures", "__pycache__"))
        for name in ("scripts/tables", "README.md", "client/library/src/failures.inc", "proto/wire/wire_enum.hpp",
                     "client/python/paraview/meshsmooth_plugin.py", "client/python/src/meshsmooth/_methods.py",
                     "client/python/src/meshsmooth/_declared_options.py", "client/python/src/meshsmooth/_tables.py",
                     "client/python/src/meshsmooth/_triangles.py",
                     "client/cli/job_flags.hpp", "client/gateway/openapi.json", "client/c/order.txt",
                     "client/c/include/meshsmooth_options.h", "client/c/src/options.inc"):
            (self.root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.root / name)

    def run_tables(self, *arguments):
        return subprocess.run([sys.executable, "-B", self.root / "scripts/tables", *arguments],
                              capture_output=True, text=True, check=False)

    def change(self, name, old, new):
        path = self.root / name
        text = path.read_text(encoding="utf-8")
        self.assertIn(old, text)
        path.write_text(text.replace(old, new, 1), encoding="utf-8")

    def check_fails(self, *parts):
        found = self.run_tables("--check")
        self.assertEqual(found.returncode, 1, found.stdout + found.stderr)
        for part in parts:
            self.assertIn(part, found.stdout + found.stderr)

    def test_passes_on_the_checkout(self):
        self.assertEqual(self.run_tables("--check").returncode, 0)

    def test_names_each_file_that_a_new_default_makes_stale_and_writes_them(self):
        self.change("proto/declaration/methods.toml", "default = 0.6307", "default = 0.5")
        self.check_fails("core/include/meshsmooth/methods.hpp", "meshsmooth/_methods.py", "run scripts/tables")
        self.assertEqual(self.run_tables().returncode, 0)
        self.assertEqual(self.run_tables("--check").returncode, 0)
        self.assertIn("double lambda = 0.5;", (self.root / "core/include/meshsmooth/methods.hpp").read_text())

    def test_finds_edits_of_what_is_made(self):
        for name, old in (("core/src/mesh/error_reasons.inc", "the queue is full"),
                          ("client/library/src/failures.inc", "client_max_body_size"),
                          ("proto/wire/wire_enum.hpp", "FORM_JACOBI"),
                          ("client/python/paraview/meshsmooth_plugin.py", '"taubin"'),
                          ("client/cli/job_flags.hpp", "Smoothing method"),
                          ("client/python/src/meshsmooth/_declared_options.py", "how nodes move"),
                          ("core/src/surface/element_triangles.inc", "{0, 1, 2}"),
                          ("client/python/src/meshsmooth/_triangles.py", "(0, 1, 2)"),
                          ("core/include/meshsmooth/option_table.hpp", "from 1 to 90 degrees"),
                          ("client/c/include/meshsmooth_options.h", "MESHSMOOTH_METHOD_TAUBIN = 4"),
                          ("client/c/src/options.inc", ".iterations = -1"),
                          ("docs/protocol.md", "the queue is full")):
            with self.subTest(name):
                before = (self.root / name).read_text(encoding="utf-8")
                self.change(name, old, "other")
                self.check_fails(name)
                (self.root / name).write_text(before, encoding="utf-8")

    def test_new_options_and_methods_come_last_in_c(self):
        order_file = self.root / "client/c/order.txt"
        before = order_file.read_text(encoding="utf-8").splitlines()
        self.change("proto/declaration/options.toml", "[tolerance]\n",
                    '[new]\ntype = "bool"\nc = "smooth.new"\ndefault = "True"\npython = "what is new"\n\n[tolerance]\n')
        found = self.run_tables()
        self.assertEqual(found.returncode, 0, found.stderr)
        self.assertEqual(order_file.read_text(encoding="utf-8").splitlines(), [*before, "option new"])
        header = (self.root / "client/c/include/meshsmooth_options.h").read_text(encoding="utf-8")
        self.assertIn("  int64_t new;  ///< What is new.\n} meshsmooth_options;", header)
        source = (self.root / "client/c/src/options.inc").read_text(encoding="utf-8")
        self.assertIn('read(in.new, "new", job.smooth.new);', source)

    def test_what_programs_in_c_use_cannot_go(self):
        self.change("client/c/order.txt", "method taubin\n", "method taubin\nmethod gone\n")
        self.check_fails("programs use the method gone, which the declaration lacks")

    def test_names_what_is_wrong_in_the_declaration(self):
        for name, old, new, told in (
            ("methods", '"[0, 1]"', '"0 to 1"', "0 to 1 is not an interval"),
            ("methods", '"taubin", "hc', '"hc', "order lacks or invents taubin"),
            ("options", '"[1, 90]"', '"1 to 90"', "1 to 90 is not an interval"),
            ("options", 'type = "int"', 'type = "text"', "iterations is not a number, but has a range"),
            ("failures", "{no_tls} unset", "{no_such} unset", "{no_such} has no cpp name"),
            ("reasons", 'exit = "stopped"', "exit = stopped", "tables: "),
        ):
            with self.subTest(told):
                path = self.root / f"proto/declaration/{name}.toml"
                before = path.read_text(encoding="utf-8")
                self.change(f"proto/declaration/{name}.toml", old, new)
                self.check_fails(told)
                path.write_text(before, encoding="utf-8")

    def test_names_a_marker_without_its_counterpart(self):
        self.change("docs/protocol.md", "<!-- end of table -->\n", "")
        self.check_fails("protocol.md: a marker of a table has no counterpart")


if __name__ == "__main__":
    unittest.main()
