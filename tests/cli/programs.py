"""Runs the built programs on real files: what all end-to-end tests share."""

import os
import re
import signal
import struct
import subprocess
import tempfile
import threading
import unittest
from pathlib import Path

from test_main import main  # noqa: F401, for the tests

CLI = os.environ.get("MESHSMOOTH_CLI", "")
SERVER = os.environ["MESHSMOOTH_SERVER"]

DONE, FAILED, USAGE, BAD_MESH, REFUSED, STOPPED = range(6)

# With these, 20,000 nodes keep a core busy for minutes: longer than any test
# that ends the job.
LONG = ["--method", "laplacian", "--guard", "off", "--relaxation", "0.05", "--tolerance", "0",
        "--iterations", "2000000000"]


def lines_of(stream):
    """Reads a stream to its end in a thread, so that no pipe ever fills up."""
    lines, arrived = [], threading.Condition()

    def read():
        with stream:
            for line in stream:
                with arrived:
                    lines.append(line)
                    arrived.notify_all()
        with arrived:
            lines.append(None)
            arrived.notify_all()

    threading.Thread(target=read, daemon=True).start()
    return lines, arrived


class Program:
    """A running program whose error output is watched."""

    def __init__(self, *command, stdin=None):
        self.process = subprocess.Popen(command, stdin=stdin, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.PIPE, text=True)
        self._lines, self._arrived = lines_of(self.process.stderr)

    def wait_for(self, pattern, timeout=60):
        """The first line that matches; fails when the program ends before."""
        def found():
            return next((m for line in self._lines if line and (m := re.search(pattern, line))),
                        None)
        with self._arrived:
            self._arrived.wait_for(lambda: found() or None in self._lines, timeout)
            match = found()
        if match is None:
            raise AssertionError(f"no {pattern!r} in {self._lines}")
        return match

    def end(self):
        """Exit code and error output, once it has ended by itself."""
        code = self.process.wait(timeout=60)
        with self._arrived:
            self._arrived.wait_for(lambda: None in self._lines, 60)
        return code, "".join(line for line in self._lines if line)

    def kill(self):
        self.process.kill()
        self.process.wait()


class ServerProgram(Program):
    """meshsmooth-server on a free port."""

    def __init__(self, *arguments):
        super().__init__(SERVER, "--listen", "127.0.0.1:0", "--lame-duck-seconds", "0",
                         "--drain-grace-seconds", "1", *arguments)
        start = self.wait_for(r'event\W+start\b.*?\bport\W+(\d+)\W+admin_port\W+(\d+)')
        self.address = "127.0.0.1:" + start.group(1)
        self.admin_address = "127.0.0.1:" + start.group(2)  # port 0 unless --admin-listen

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()


class CliTest(unittest.TestCase):
    """A test with a folder of its own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="meshsmooth-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def path(self, name):
        return str(self.folder / name)

    def run_cli(self, *arguments, exit_code=DONE):
        result = subprocess.run([CLI, *map(str, arguments)], capture_output=True, text=True,
                                timeout=120)
        self.assertEqual(result.returncode, exit_code, f"{arguments}\n{result.stderr}")
        if exit_code != DONE:
            last_line = result.stderr.strip().splitlines()[-1]
            self.assertTrue(last_line.startswith("meshsmooth: "), result.stderr)
        return result

    def error_of(self, *arguments, exit_code):
        """The last line of stderr: the error."""
        return self.run_cli(*arguments, exit_code=exit_code).stderr.strip().splitlines()[-1]

    def generate(self, name, shape="cube", nodes=2000, seed=1, **options):
        path = self.path(name)
        extra = [part for key, value in options.items() for part in (f"--{key}", str(value))]
        self.run_cli("generate", shape, "--nodes", nodes, "--seed", seed, *extra, "-o", path)
        return path

    def files(self):
        return sorted(file.name for file in self.folder.iterdir())

    def start_long_job(self, mesh, output, *arguments):
        """A job of 20,000 nodes or more that is iterating."""
        job = Program(CLI, "smooth", mesh, "-o", output, *LONG, *arguments)
        self.addCleanup(job.kill)
        job.wait_for("iterate")
        return job


def interrupt(program):
    program.process.send_signal(signal.SIGINT)


def vtk_text(points, cells, cell_type=10):
    """A mesh as legacy VTK; cells are tetrahedra unless said otherwise."""
    size = sum(len(cell) + 1 for cell in cells)
    lines = ["# vtk DataFile Version 3.0", "test", "ASCII", "DATASET UNSTRUCTURED_GRID",
             f"POINTS {len(points)} double"]
    lines += [" ".join(map(str, point)) for point in points]
    lines += [f"CELLS {len(cells)} {size}"]
    lines += [" ".join(map(str, [len(cell), *cell])) for cell in cells]
    lines += [f"CELL_TYPES {len(cells)}"] + [str(cell_type)] * len(cells)
    return "\n".join(lines) + "\n"


def read_vtk_points(path):
    """The points of a legacy VTK file in text or binary, as big-endian bytes."""
    data = Path(path).read_bytes()
    match = re.search(rb"POINTS (\d+) (double|float)\n", data)
    count = int(match.group(1)) * 3
    kind = "d" if match.group(2) == b"double" else "f"
    if data.split(b"\n", 3)[2] == b"ASCII":
        numbers = data[match.end():].split(maxsplit=count)[:count]
        return struct.pack(f">{count}{kind}", *map(float, numbers))
    size = count * struct.calcsize(kind)
    return data[match.end():match.end() + size]
