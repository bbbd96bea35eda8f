"""The files of others in tests/corpus/files: each one ends as expected.json says, with as many nodes
and cells of each type, and changes in its coordinates only.

    corpus_files_test.py --update      writes expected.json from what the driver does now
"""

import json
import os
import sys
import tempfile
import unittest
from pathlib import Path

from test_main import main

HERE = Path(__file__).resolve().parent
FILES = HERE / "files"
EXPECTED = HERE / "expected.json"
sys.path.insert(0, str(HERE.parents[1] / "scripts" / "corpus.d"))
sys.dont_write_bytecode = True

import run  # noqa: E402


def outcomes():
    paths = sorted(path for path in FILES.rglob("*") if path.is_file()
                   and path.suffix not in (".ele", ".md", ".txt"))
    rows = [{"file": str(path.relative_to(FILES))} for path in paths]
    with tempfile.TemporaryDirectory() as scratch:
        steps = run.run_driver(os.environ["MESHSMOOTH_CORPUS_DRIVER"], rows, FILES,
                               os.cpu_count(), scratch=scratch)
    found = {}
    for row in run.make_outcomes(rows, steps):
        kept = {"outcome": "ok" if row["outcome"] == "worse" else row["outcome"]}
        if "reason" in row:
            kept |= {"at": row["at"], "reason": row["reason"]}
        if row["counts"]:
            kept |= row["counts"]
        found[row["file"]] = kept
    return found


class CorpusFiles(unittest.TestCase):
    def test_each_file_ends_as_expected(self):
        self.maxDiff = None
        expected = json.loads(EXPECTED.read_text())
        found = outcomes()
        self.assertEqual(set(found), set(expected))
        differing = {file: (expected[file], found[file]) for file in expected
                     if expected[file] != found[file]}
        self.assertEqual(differing, {}, "expected and found; --update after checking each")

    def test_none_is_expected_to_go_wrong(self):
        for file, row in json.loads(EXPECTED.read_text()).items():
            self.assertIn(row["outcome"], ("ok", "refused"), file)


if __name__ == "__main__":
    if "--update" in sys.argv:
        lines = [f"{json.dumps(file)}: {json.dumps(row)}" for file, row in sorted(outcomes().items())]
        EXPECTED.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    else:
        main()
