"""Meshes made from what the packages carry: geometries by Gmsh, OpenFOAM cases by blockMesh."""

import concurrent.futures
import os
import pathlib
import shutil
import subprocess

from gather import HERE, MAX_BYTES

CASES = 60  # at most, of OpenFOAM


def make_by_gmsh(python, geometries, folder, jobs):
    """Up to ten files a geometry, in a folder each; geometries that Gmsh cannot mesh in a minute
    give none."""
    def mesh(number, geometry):
        into = folder / f"{number:03}-{geometry.stem}"
        if (into / ".complete").exists():
            return
        shutil.rmtree(into, ignore_errors=True)
        into.mkdir(parents=True)
        try:
            subprocess.run([python, HERE / "gmsh_variants.py", geometry, into, str(number)],
                           capture_output=True, timeout=300, cwd=into, check=False)
        except subprocess.TimeoutExpired:
            shutil.rmtree(into)  # what is half written would differ from run to run
            into.mkdir()
        (into / ".complete").touch()

    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        list(pool.map(mesh, range(len(geometries)), geometries))
    return folder


def make_by_block_mesh(tutorials, folder):
    """The first cases below a folder that blockMesh finishes."""
    environment = {"WM_PROJECT_DIR": "/usr/share/openfoam", **os.environ}  # Debian's place
    made = 0
    for dictionary in sorted(pathlib.Path(tutorials).rglob("system/blockMeshDict")):
        case = dictionary.parent.parent
        into = folder / "-".join(case.relative_to(tutorials).parts[-3:])
        if not (into / ".complete").exists():
            shutil.rmtree(into, ignore_errors=True)
            shutil.copytree(case / "system", into / "system")
            (into / "constant").mkdir()
            try:
                subprocess.run(["blockMesh", "-case", into], capture_output=True, timeout=60,
                               check=False, env=environment)
            except subprocess.TimeoutExpired:
                pass
            (into / ".complete").touch()
        mesh = into / "constant" / "polyMesh"
        if not (mesh / "points").exists():
            continue
        if sum(file.stat().st_size for file in mesh.iterdir() if file.is_file()) > MAX_BYTES:
            shutil.rmtree(mesh)
            continue
        made += 1
        if made == CASES:
            break
    return folder
