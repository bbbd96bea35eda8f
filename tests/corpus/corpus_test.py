"""The mesh files of Debian packages and PyPI distributions, by scripts/corpus --check."""

import os
import subprocess
import sys
import unittest
from pathlib import Path

from test_main import main, needs_peers

ROOT = Path(__file__).resolve().parents[2]


@needs_peers
class Corpus(unittest.TestCase):
    def test_no_file_of_others_goes_wrong(self):
        done = subprocess.run(
            [sys.executable, ROOT / "scripts" / "corpus", "--check", "--driver",
             os.environ["MESHSMOOTH_CORPUS_DRIVER"]], capture_output=True, text=True)
        print(done.stdout)
        self.assertEqual(done.returncode, 0, done.stdout[-8000:] + done.stderr[-2000:])


if __name__ == "__main__":
    main()
