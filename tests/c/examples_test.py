#!/usr/bin/env python3
"""The examples in C, Fortran and ctypes: they build without warnings, get the C++ client's bits, and tell errors."""

import os
import re
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import header
from programs import SERVER, Program
from test_main import main

EXAMPLES = header.ROOT / "examples/c"
LIBRARY = Path(os.environ["MESHSMOOTH_C_LIBRARY"])
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
LINK = [f"-L{LIBRARY.parent}", "-lmeshsmooth_client", f"-Wl,-rpath,{LIBRARY.parent}"]
# The mesh of the examples, as cpp_client reads it.
COORDINATES = [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.1, 0.1, 0.1]
TETRAHEDRA = [4, 1, 2, 3, 0, 4, 2, 3, 0, 1, 4, 3, 0, 1, 2, 4]
MESH = struct.pack("3q15d16i", 5, 4, 0, *COORDINATES, *TETRAHEDRA)


class Examples(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Program(SERVER, "--listen", "unix:", "--backend", "cpu", "--lanes", "1", "--lame-duck-seconds", "0")
        cls.addClassCleanup(cls.server.kill)
        cls.target = "unix:" + cls.server.wait_for(r"event=start.* listen=unix:(\S+)").group(1)
        bits = subprocess.run([os.environ["MESHSMOOTH_CPP_CLIENT"], cls.target, "worst"], input=MESH,
                              stdout=subprocess.PIPE, check=True, timeout=60).stdout
        cls.node = struct.unpack("3d", bits[-24:])

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="meshsmooth-")
        self.addCleanup(folder.cleanup)
        self.program = Path(folder.name) / "smooth"
        self.folder = folder.name

    def build(self, *command):
        subprocess.run([*command, *LINK, "-o", self.program], check=True, cwd=self.folder)

    def check(self, *command):
        """What an example prints, of a server and without one."""
        printed = subprocess.run([*command, self.target, *self.more], capture_output=True, text=True, timeout=60)
        self.assertEqual(printed.returncode, 0, printed.stderr)
        self.assertIn("inverted: 0, moved: 1\n", printed.stdout)
        node = re.search(r"node 4: (.*)", printed.stdout).group(1)
        self.assertEqual(tuple(map(float, node.split())), self.node)  # 17 digits are all bits
        self.assertNotEqual(self.node, tuple(COORDINATES[-3:]))
        printed = subprocess.run([*command, "unix:/nowhere/socket", *self.more], capture_output=True, text=True, timeout=60)
        self.assertEqual(printed.returncode, 1)
        self.assertIn("/nowhere/socket", printed.stderr + printed.stdout)

    more = ()

    def test_c(self):
        self.build(os.environ["MESHSMOOTH_CC"], "-std=c11", *WARNINGS, "-I", header.INCLUDE, EXAMPLES / "smooth.c")
        self.check(self.program)

    def test_fortran(self):
        if not os.environ["MESHSMOOTH_FORTRAN"]:
            self.skipTest("gfortran is not installed")
        self.build(os.environ["MESHSMOOTH_FORTRAN"], "-std=f2018", *WARNINGS, EXAMPLES / "smooth.f90")
        self.check(self.program)

    def test_ctypes(self):
        self.more = (LIBRARY,)
        self.check(sys.executable, EXAMPLES / "smooth_ctypes.py")

    def test_the_header_is_that_of_cpp_too(self):
        source = Path(self.folder) / "includes.cpp"
        source.write_text("#include <meshsmooth.h>\nint main() { return meshsmooth_version() == nullptr; }\n")
        self.build(os.environ["MESHSMOOTH_CC"], *WARNINGS, "-I", header.INCLUDE, source)
        subprocess.run([self.program], check=True, timeout=60)


if __name__ == "__main__":
    main()
