#!/usr/bin/env python3
"""The protocol's files follow Buf's rules, and break nothing of the last version (proto/released.binpb)."""

import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from test_main import main

ROOT = Path(__file__).resolve().parents[2]
OWN = ROOT / "build/python/bin/buf"
BUF = str(OWN) if OWN.exists() else shutil.which("buf")
SMOOTHING = "meshsmooth/v1/smoothing.proto"


@unittest.skipUnless(BUF, "buf is not installed (scripts/test installs it from PyPI)")
class ProtocolFiles(unittest.TestCase):
    def buf(self, command, folder, *arguments):
        return subprocess.run([BUF, command, folder, *arguments], capture_output=True, text=True, check=False)

    def breaking(self, folder):
        return self.buf("breaking", folder, "--against", ROOT / "proto/released.binpb")

    def test_follow_the_rules(self):
        result = self.buf("lint", ROOT / "proto")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_break_nothing_of_the_last_version(self):
        result = self.breaking(ROOT / "proto")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_a_change_that_breaks_is_found(self):
        with tempfile.TemporaryDirectory() as folder:
            copy = shutil.copytree(ROOT / "proto", Path(folder) / "proto")
            text = (copy / SMOOTHING).read_text()
            changed = text.replace("optional int32 max_iteration_count", "optional int64 max_iteration_count")
            self.assertNotEqual(changed, text)
            (copy / SMOOTHING).write_text(changed)
            result = self.breaking(copy)
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("max_iteration_count", result.stdout)


if __name__ == "__main__":
    main()
