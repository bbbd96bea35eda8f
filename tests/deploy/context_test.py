"""The images build from what docker/Dockerfile is given: .dockerignore names what the configuration
and docker/pack read. Needs no container engine."""

import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from programs import SERVER
from test_main import main

ROOT = Path(__file__).parents[2]


def run(*command, folder):
    """A command to its end, which must be good."""
    result = subprocess.run(list(map(str, command)), cwd=folder, text=True, timeout=300,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if result.returncode != 0:
        raise AssertionError(f"{command}: exit code {result.returncode}\n{result.stdout}")


class BuildContext(unittest.TestCase):
    def test_configures_and_packs(self):
        lines = (ROOT / ".dockerignore").read_text().splitlines()
        patterns = [line for line in lines if not line.startswith("#")]
        self.assertEqual(patterns[0], "**")
        dockerfile = (ROOT / "docker/Dockerfile").read_text()
        copied = re.findall(r"^COPY (?!--from)(\S+) ", dockerfile, re.MULTILINE)
        with tempfile.TemporaryDirectory(prefix="meshsmooth-") as folder:
            context = Path(folder) / "src"
            for pattern in patterns[1:]:
                self.assertEqual(pattern[0], "!", pattern)
                source, target = ROOT / pattern[1:], context / pattern[1:]
                target.parent.mkdir(parents=True, exist_ok=True)
                (shutil.copytree if source.is_dir() else shutil.copy)(source, target)
            self.assertTrue(copied)
            for path in copied:
                self.assertTrue((context / path).exists(), path)
            run("cmake", "--preset", "image", "-D", "MESHSMOOTH_CUDA=OFF", folder=context)
            run("docker/pack", Path(SERVER).parents[1], context / "image", "meshsmooth-server",
                "meshsmooth", folder=context)


if __name__ == "__main__":
    main()
