#!/usr/bin/env python3
"""Removes noise from a sphere by a foreign filter.

    surfaces.py NAME NOISY.npz OUT.npz

Files hold `points` and `cells` (triangles). The last line of stdout is JSON: the CPU seconds of
the filter alone and its version.
"""

import importlib.metadata
import json
import sys

import numpy
from measure import make_surface
from programs import Timer

ITERATIONS = 20


def by_vtk(name, points, cells):
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    smoother = getattr(vtk, name)()
    smoother.SetInputData(make_surface(points, cells))
    smoother.SetNumberOfIterations(ITERATIONS)
    if name == "vtkSmoothPolyDataFilter":
        smoother.SetRelaxationFactor(0.5)
    else:
        smoother.NormalizeCoordinatesOn()
    with Timer() as timer:
        smoother.Update()
    moved = vtk_to_numpy(smoother.GetOutput().GetPoints().GetData())
    return moved, timer, f"VTK {vtk.vtkVersion.GetVTKVersion()}"


def by_trimesh(name, points, cells):
    import trimesh

    mesh = trimesh.Trimesh(points, cells, process=False)
    filters = {"laplacian": trimesh.smoothing.filter_laplacian,
               "taubin": trimesh.smoothing.filter_taubin,
               "humphrey": trimesh.smoothing.filter_humphrey}
    with Timer() as timer:
        filters[name](mesh, iterations=ITERATIONS)
    return numpy.asarray(mesh.vertices), timer, f"trimesh {trimesh.__version__}"


def by_pymeshlab(name, points, cells):
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(points, cells))
    with Timer() as timer:
        if name == "taubin":
            meshes.apply_coord_taubin_smoothing(stepsmoothnum=ITERATIONS)
        else:
            meshes.apply_coord_hc_laplacian_smoothing()
    version = importlib.metadata.version("pymeshlab")
    return meshes.current_mesh().vertex_matrix(), timer, f"PyMeshLab {version}"


FILTERS = {"vtk": by_vtk, "trimesh": by_trimesh, "pymeshlab": by_pymeshlab}


def main():
    package, name = sys.argv[1].split(":")
    mesh = numpy.load(sys.argv[2])
    moved, timer, version = FILTERS[package](name, mesh["points"], mesh["cells"])
    numpy.savez(sys.argv[3], points=moved, cells=mesh["cells"])
    print(json.dumps({"seconds": timer.seconds, "version": version}))


if __name__ == "__main__":
    main()
