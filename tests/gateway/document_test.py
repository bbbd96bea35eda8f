#!/usr/bin/env python3
"""docs/gateway.md: its lines of curl do what they say."""

import re
import shutil
import subprocess
import unittest
from pathlib import Path

from gateway_program import GATEWAY, GatewayTest, main

ROOT = Path(__file__).resolve().parents[2]
DOCUMENT = ROOT / "docs/gateway.md"


class Document(GatewayTest):
    @unittest.skipUnless(shutil.which("curl"), "curl is not installed")
    def test_every_line_runs(self):
        blocks = re.findall(r"^```sh\n(.*?)^```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
        # The first starts server and gateway, which run already.
        script = "".join(block for block in blocks if "meshsmooth-gateway" not in block)
        self.assertEqual(script.count("curl "), 12)
        self.mesh("part.inp")
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", script.replace("127.0.0.1:8080", f"127.0.0.1:{self.gateway.port}")],
                              cwd=self.folder, capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("event: end", done.stdout)
        self.assertEqual(self.files(), ["better.inp", "better.vtu", "job.json", "moved.inp", "part.inp", "report.html", "summary.json"])
        self.check_nothing_left()

    def test_flags_of_documents_and_samples_are_there(self):
        flags = set(re.findall(r"--[a-z][a-z-]*", subprocess.run(
            [GATEWAY, "--help"], capture_output=True, text=True, timeout=60, check=True).stdout))
        compose = (ROOT / "docker/compose.yaml").read_text(encoding="utf-8")
        service = re.search(r"^  gateway:\n(?:    .*\n)+", compose, re.MULTILINE).group(0)
        sidecar = (ROOT / "deploy/kubernetes/components/gateway/sidecar.yaml").read_text(encoding="utf-8")
        inline = " ".join(re.findall(r"`(--[a-z-]+)", DOCUMENT.read_text(encoding="utf-8")))
        for text in (service, sidecar, inline):
            used = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", text))
            self.assertGreater(len(used), 3)
            self.assertEqual(used - flags, set())
        version = re.search(r"project\(meshsmooth VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)
        self.assertIn(f"meshsmooth-gateway:{version}", service)


if __name__ == "__main__":
    main()
