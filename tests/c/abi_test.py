#!/usr/bin/env python3
"""What programs were compiled with stays: symbols, constants, and sizes and offsets of structures are those of abi.txt.

    tests/c/abi_test.py            compares
    tests/c/abi_test.py --write    writes abi.txt after something was added; lines that change or go break programs
"""

import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import header
from test_main import main

BASELINE = Path(__file__).with_name("abi.txt")


def compiled(source, folder, *flags):
    path = Path(folder) / "program.c"
    path.write_text(source, encoding="utf-8")
    program = Path(folder) / "program"
    subprocess.run([os.environ["MESHSMOOTH_CC"], *flags, "-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror",
                    "-I", header.INCLUDE, path, "-o", program], check=True)
    return subprocess.run([program], check=True, capture_output=True, text=True).stdout


def layout():
    """As the compiler has it."""
    lines = ["#include <stdio.h>", '#include "meshsmooth.h"', "int main(void) {"]
    for name, members in header.structures():
        lines.append(f'  printf("structure {name} %zu\\n", sizeof({name}));')
        lines += [f'  printf("member {name}.{member} %zu\\n", offsetof({name}, {member}));' for _, member in members]
    lines += [f'  printf("constant {name} %d\\n", {name});' for name in header.constants()]
    with tempfile.TemporaryDirectory() as folder:
        return compiled("\n".join([*lines, "  return 0;", "}", ""]), folder).splitlines()


def symbols():
    table = subprocess.run(["nm", "--dynamic", "--defined-only", "--format=posix", os.environ["MESHSMOOTH_C_LIBRARY"]],
                           check=True, capture_output=True, text=True).stdout
    return sorted(f"symbol {line.split()[0]} {line.split()[1]}" for line in table.splitlines())


class Abi(unittest.TestCase):
    maxDiff = None

    def test_is_that_of_the_baseline(self):
        self.assertEqual(BASELINE.read_text(encoding="utf-8").splitlines(), symbols() + layout(),
                         "the ABI differs from tests/c/abi.txt; if it only grew, run tests/c/abi_test.py --write")

    def test_exports_the_functions_of_the_header_alone(self):
        self.assertEqual([f"symbol {name} T" for name in sorted(header.functions())], symbols())

    def test_members_have_eight_bytes_so_that_structures_can_grow(self):
        for line in layout():
            kind, _, number = line.split()
            if kind in ("structure", "member"):
                self.assertEqual(int(number) % 8, 0, line)
        for name, members in header.structures():
            self.assertIn(f"structure {name} {8 * len(members)}", layout())

    def test_soname_has_the_major_version(self):
        dynamic = subprocess.run(["readelf", "--dynamic", "--wide", os.environ["MESHSMOOTH_C_LIBRARY"]], check=True,
                                 capture_output=True, text=True).stdout
        major = header.Library().version().decode().split(".")[0]
        self.assertIn(f"[libmeshsmooth_client.so.{major}]", dynamic)


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        BASELINE.write_text("\n".join(symbols() + layout()) + "\n", encoding="utf-8")
    else:
        main()
