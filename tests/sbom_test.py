"""scripts/check-sbom finds what the list of vulnerabilities has."""

import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import test_main

ROOT = Path(__file__).parents[1]
REFUSED = "--refuse", "grpc"


class Sbom(unittest.TestCase):
    def check(self, source: str, *flags: str) -> subprocess.CompletedProcess:
        with tempfile.TemporaryDirectory() as folder:
            sbom = Path(folder) / "sbom.spdx"
            sbom.write_text("SPDXVersion: SPDX-2.3\n" + source)
            return subprocess.run([sys.executable, ROOT / "scripts" / "check-sbom", *flags,
                                   sbom],
                                  capture_output=True, text=True)

    def test_names_accepted_ones_of_an_old_grpc(self):
        result = self.check("PackageSourceInfo: built from grpc 1.51.1-3\n")
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertIn("CVE-2024-7246", result.stdout)
        self.assertIn("accepted", result.stdout)

    def test_accepts_none_where_a_new_grpc_is_asked_for(self):
        result = self.check("PackageSourceInfo: built from grpc 1.51.1-3\n", *REFUSED)
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertNotIn("accepted", result.stdout)
        self.assertEqual(self.check("PackageSourceInfo: built from grpc 1.83.0-1\n",
                                    *REFUSED).returncode, 0)
        result = self.check("PackageSourceInfo: built from cpp-httplib 0.11.4-1\n", *REFUSED)
        self.assertEqual(result.returncode, 0, result.stdout)

    def test_an_epoch_makes_no_version_newer(self):
        result = self.check("PackageSourceInfo: built from grpc 1:1.51.1-3\n", *REFUSED)
        self.assertEqual(result.returncode, 1, result.stdout)

    def test_finds_the_old_one_of_two_versions(self):
        old, new = (f"PackageSourceInfo: built from grpc {version}\n"
                    for version in ("1.51.1-3", "1.83.0-1"))
        for sbom in old + new, new + old:
            self.assertEqual(self.check(sbom, *REFUSED).returncode, 1)

    def test_unknown_flags_are_refused(self):
        self.assertEqual(self.check("", "--refus").returncode, 2)

    def test_finds_none_in_a_new_grpc(self):
        result = self.check("PackageSourceInfo: built from grpc 1.83.0-1\n")
        self.assertEqual(result.returncode, 0)
        self.assertNotIn("CVE", result.stdout)

    def test_finds_none_open_in_what_this_build_links(self):
        build = Path(os.environ.get("MESHSMOOTH_BUILD", ""))
        if not (build / "build.ninja").is_file():
            self.skipTest("no build by ninja")
        script = """
            set -euo pipefail
            . scripts/lib.sh; . scripts/sbom.sh
            compiled_packages "$1" meshsmooth-server | sed 's/$/ STATIC_LINK/' |
              write_spdx test 0 test >"$2"
            scripts/check-sbom "$2"
            """
        with tempfile.TemporaryDirectory() as folder:
            result = subprocess.run(["bash", "-c", script, "-", build, Path(folder) / "sbom.spdx"],
                                    cwd=ROOT, capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("no open vulnerabilities", result.stdout)

    def test_fails_without_packages(self):
        self.assertEqual(self.check("").returncode, 1)

    def test_every_row_has_its_columns(self):
        for line in (ROOT / "scripts" / "vulnerabilities.tsv").read_text().splitlines():
            self.assertEqual(line.count("\t") if not line.startswith("#") else 4, 4, line)


if __name__ == "__main__":
    test_main.main()
