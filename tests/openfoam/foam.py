"""Runs programs of OpenFOAM with the motion solver, which is built for them once."""

import os
import re
import resource
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
SERVER = os.environ.get("MESHSMOOTH_SERVER", "")
LIBRARY = os.environ.get("MESHSMOOTH_C_LIBRARY", "")
BUILD = Path(os.environ.get("MESHSMOOTH_FOAM_BUILD", ""))


def build():
    """client/openfoam/build, with the C library of this build, where a source has changed."""
    result, sources = BUILD / "libmeshsmoothMotion.so", (ROOT / "client/openfoam").iterdir()
    if result.exists() and result.stat().st_mtime > max(file.stat().st_mtime for file in sources):
        return
    folder = os.path.dirname(LIBRARY)
    subprocess.run([ROOT / "client/openfoam/build", BUILD, f"-I{ROOT}/client/c/include", f"-L{folder}",
                    "-lmeshsmooth_client", f"-Wl,-rpath,{folder}"], check=True)


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run(folder, *command, **variables):
    """The ended process and its CPU seconds, with those of the server that it has started."""
    environment = {"WM_PROJECT_DIR": "/usr/share/openfoam", **os.environ, "LD_LIBRARY_PATH": str(BUILD),
                   "MESHSMOOTH_SERVER": "", "MESHSMOOTH_SERVER_BINARY": SERVER, **variables}
    before = cpu_seconds()
    ended = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False,
                           timeout=1200)
    return ended, cpu_seconds() - before


def checked_times(folder, *flags):
    """Whether checkMesh accepts the mesh, by time."""
    ended, _ = run(folder, "checkMesh", *flags)
    times = re.split(r"^Time = (\S+)$", ended.stdout, flags=re.M)[1:]
    return {float(time): "\nMesh OK." in text for time, text in zip(times[::2], times[1::2])}


def points(folder, time):
    """Of an ASCII or binary file, as OpenFOAM's own tool tells them: bytes, to be compared."""
    return (Path(folder) / str(time) / "polyMesh/points").read_bytes().split(b"object", 1)[1]
