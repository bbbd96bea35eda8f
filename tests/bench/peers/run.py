#!/usr/bin/env python3
"""Runs meshsmooth and other optimizers on the same meshes and records docs/results/peers.json.

    run.py MESHSMOOTH [--only TABLE …] [--limit CPU_SECONDS] [--output FILE]

Needs, in the Python that runs it: pip install mfem gmsh mmgpy trimesh pymeshlab vtk scipy; for the
motions also Debian's openfoam. A program that is missing or fails has its message in its row.
CPU seconds are user and system time of all threads: of meshsmooth those of the whole program with
files and its embedded server, of the others those of the optimizer alone, but of OpenFOAM the
program moveMesh. Scripts/results writes the tables into the documents.
"""

import argparse
import datetime
import json
import pathlib
import platform
import resource
import subprocess
import sys
import tempfile

import cases
import numpy

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]


class Runner:
    """Runs programs on files in a folder and keeps their versions."""

    def __init__(self, meshsmooth, folder, limit):
        self.folder = pathlib.Path(folder)
        self.versions = set()
        self._meshsmooth = meshsmooth
        self._limit = limit
        self.version_of_meshsmooth()

    def version_of_meshsmooth(self):
        done = subprocess.run([self._meshsmooth, "--version"], capture_output=True, text=True)
        self.versions.add(f"meshsmooth {done.stdout.split()[-1] if done.stdout else '?'}")

    def file(self, name):
        return self.folder / name

    def meshsmooth(self, *arguments):
        """Returns the CPU seconds of the whole program; exits on an error."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([self._meshsmooth, *map(str, arguments)], capture_output=True,
                              text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode not in (0, 6):  # 6: a part of the motion
            sys.exit(f"meshsmooth {arguments}: {done.stderr}")
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def generate(self, name, *arguments):
        self.meshsmooth("generate", *arguments, "-o", self.file(name))
        return self.file(name)

    def foreign(self, script, *arguments):
        """Returns (points, cells, CPU seconds), or why there are none."""
        target = self.file("result.npz")
        target.unlink(missing_ok=True)

        def limit():
            resource.setrlimit(resource.RLIMIT_CPU, (self._limit, self._limit + 5))

        where = [*map(str, arguments)]
        where[where.index("OUT")] = str(target)
        done = subprocess.run([sys.executable, "-B", HERE / script, *where], capture_output=True,
                              text=True, preexec_fn=limit)
        if done.returncode < 0:
            used_up = -done.returncode in (9, 24)
            return f"no result in {self._limit} s" if used_up else "crashes"
        if done.returncode:
            print(done.stderr[-600:], file=sys.stderr)
            return "fails"
        report = json.loads(done.stdout.splitlines()[-1])
        self.versions.add(report["version"])
        with numpy.load(target) as result:
            return result["points"], result["cells"], report["seconds"]


def git(*arguments):
    return subprocess.run(["git", "-C", ROOT, *arguments], capture_output=True, text=True,
                          check=True).stdout.strip()


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.machine()


def record(path, name, table, versions):
    """Replaces a table of the recorded run, or adds it."""
    old = json.loads(path.read_text()) if path.exists() else {"tables": {}}
    tables = old["tables"] | {name: table}
    versions = sorted(versions | set(old.get("versions", ())))
    order = [*(name for name in cases.TABLES if name in tables),
             *(name for name in tables if name not in cases.TABLES)]
    today, commit = datetime.date.today().isoformat(), git("rev-parse", "--short", "HEAD")
    run = {
        "title": "meshsmooth beside other mesh optimizers",
        "machine": f"two shared cores of an {processor()} (CPU backend)",
        "command": "tests/bench/peers/run.py meshsmooth",
        "date": today,
        "commit": commit,
        "recorded": {"commit": commit, "date": today},
        "notes": "CPU seconds of one run, user and system: of meshsmooth the whole program with "
                 "files and embedded server, of the others the optimizer alone, of OpenFOAM "
                 "moveMesh. Quality by tests/bench/peers/measure.py. "
                 f"Versions: {', '.join(versions)}.",
        "versions": versions,
        "tables": {name: tables[name] for name in order},
    }
    path.write_text(json.dumps(run, indent=2, ensure_ascii=False) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshsmooth")
    parser.add_argument("--only", nargs="+", choices=cases.TABLES, default=list(cases.TABLES))
    parser.add_argument("--limit", type=int, default=600, help="CPU seconds of a foreign program")
    parser.add_argument("--output", type=pathlib.Path, default=ROOT / "docs/results/peers.json")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="peers-") as folder:
        runner = Runner(options.meshsmooth, folder, options.limit)
        for name in options.only:
            table = cases.TABLES[name](runner)
            for row in table["rows"]:
                print(" | ".join(map(str, row)), flush=True)
            record(options.output, name, table, runner.versions)


if __name__ == "__main__":
    main()
