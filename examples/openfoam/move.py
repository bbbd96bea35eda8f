"""Moves the boundary of an OpenFOAM case: the floor of a box swells, the cells above it follow.

    blockMesh && foamToVTK -legacy -no-boundary && python3 move.py && checkMesh -latestTime

foamToVTK keeps the order of the points, so those of the result are written as the points of the
time 1. Cells must be hexahedra, wedges, pyramids or tetrahedra.

Needs: numpy, meshio
"""

import pathlib

import meshio
import numpy as np

import meshsmooth as ms

CASE = pathlib.Path.cwd()
HEADER = "FoamFile { version 2.0; format ascii; class vectorField; object points; }\n"

mesh = meshio.read(next(CASE.glob("VTK/*_0.vtk")))
x, y, z = mesh.points.T
on_floor = z == 0
displacement = np.zeros_like(mesh.points)
displacement[on_floor, 2] = (0.5 * np.exp(-8 * ((x - 1) ** 2 + (y - 0.5) ** 2)))[on_floor]
# The points on the other walls slide in their planes.
result = ms.move(mesh, displacement=displacement, prescribed=on_floor, boundary="slide", full=True)
print(result)

folder = CASE / "1" / "polyMesh"
folder.mkdir(parents=True, exist_ok=True)
with open(folder / "points", "w") as file:
    file.write(f"{HEADER}{len(x)}\n(\n")
    np.savetxt(file, result.points, fmt="(%.17g %.17g %.17g)")
    file.write(")\n")
