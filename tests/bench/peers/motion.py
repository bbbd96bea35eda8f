#!/usr/bin/env python3
"""Moves the boundary of a tetrahedral mesh by a foreign program, the interior by its rule.

    motion.py openfoam|laplace REFERENCE.vtk MOVED.vtk OUT.npz

Boundary nodes go where MOVED has them. The last line of stdout is JSON: CPU seconds (user and
system; OpenFOAM's with reading and writing, of the Laplace equation assembly and solution alone)
and the version.
"""

import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time

import numpy
from measure import boundary_nodes, make_grid, read


def laplace(points, cells, moved):
    """Linear elements, conjugate gradients with the diagonal as preconditioner, in SciPy."""
    import scipy
    import scipy.sparse.linalg

    start = time.process_time()
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    gradients = numpy.linalg.inv(edges).transpose(0, 2, 1)
    gradients = numpy.concatenate([-gradients.sum(axis=1, keepdims=True), gradients], axis=1)
    volume = numpy.linalg.det(edges) / 6
    local = numpy.einsum("eia,eja,e->eij", gradients, gradients, volume)
    rows, columns = numpy.repeat(cells, 4, axis=1), numpy.tile(cells, (1, 4))
    matrix = scipy.sparse.coo_matrix((local.ravel(), (rows.ravel(), columns.ravel()))).tocsr()
    free = numpy.ones(len(points), bool)
    free[boundary_nodes(cells)] = False
    displacement = numpy.where(free[:, None], 0, moved - points)
    inner = matrix[free][:, free]
    jacobi = scipy.sparse.diags(1 / inner.diagonal())
    load = -matrix[free] @ displacement
    for axis in range(3):
        displacement[free, axis], failed = scipy.sparse.linalg.cg(
            inner, load[:, axis], rtol=1e-6, atol=0, M=jacobi)
        assert not failed
    seconds = time.process_time() - start
    return points + displacement, seconds, f"SciPy {scipy.__version__}"


HEADER = """FoamFile
{{
    version 2.0; format ascii; class {kind}; location "{place}"; object {name};
}}
"""
FILES = {
    "system/controlDict": ("dictionary", """application moveMesh; startFrom startTime; startTime 0;
stopAt endTime; endTime 1; deltaT 1; writeControl timeStep; writeInterval 1; writeFormat ascii;
writePrecision 17; timePrecision 6;"""),
    "system/fvSchemes": ("dictionary", """ddtSchemes { default Euler; } gradSchemes { default Gauss
linear; } divSchemes { default none; } laplacianSchemes { default Gauss linear corrected; }
interpolationSchemes { default linear; } snGradSchemes { default corrected; }"""),
    "system/fvSolution": ("dictionary", """solvers { cellDisplacement { solver GAMG; smoother
GaussSeidel; tolerance 1e-12; relTol 1e-6; } }"""),
    "constant/dynamicMeshDict": ("dictionary", """dynamicFvMesh dynamicMotionSolverFvMesh;
motionSolverLibs ("libfvMotionSolvers.so"); solver displacementLaplacian;
displacementLaplacianCoeffs { diffusivity uniform; }"""),
}


def numbers_of(path, kind):
    """The entries of a list in OpenFOAM's text format."""
    content = re.sub(r"/\*.*?\*/", "", path.read_text(), flags=re.DOTALL)
    content = re.sub(r"//.*", "", content)
    content = re.sub(r"FoamFile\s*\{.*?\}", "", content, flags=re.DOTALL)
    return numpy.array(re.findall(r"[-+.\de]+", content)[1:], kind)


def as_list(rows):
    return f"{len(rows)}\n(\n" + "".join(
        f"({' '.join(map(repr, row))})\n" for row in rows.tolist()) + ")\n"


def openfoam(points, cells, moved):
    """moveMesh with displacementLaplacian, uniform diffusivity."""
    import vtk

    environment = os.environ | {"WM_PROJECT_DIR": "/usr/share/openfoam"}
    with tempfile.TemporaryDirectory() as name:
        case = pathlib.Path(name)

        def write(path, kind, content):
            file = case / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(HEADER.format(kind=kind, place=file.parent.name, name=file.name)
                            + content)

        def run(*command):
            done = subprocess.run([*command, "-case", str(case)], env=environment, text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            if done.returncode:
                sys.exit(done.stdout[-2000:])
            return done.stdout

        for path, (kind, content) in FILES.items():
            write(path, kind, content)
        writer = vtk.vtkUnstructuredGridWriter()
        writer.SetFileVersion(42)
        writer.SetFileName(str(case / "mesh.vtk"))
        writer.SetInputData(make_grid(points, cells))
        writer.Write()
        log = run("vtkUnstructuredToFoam", str(case / "mesh.vtk"))
        version = re.search(r"OPENFOAM=(\d+)", log)[1]
        mesh = case / "constant/polyMesh"
        # The text of the VTK file has fewer digits than the positions.
        write("constant/polyMesh/points", "vectorField", as_list(points))
        patch = (mesh / "boundary").read_text()
        first, count = (int(re.search(rf"{key}\s+(\d+)", patch)[1])
                        for key in ("startFace", "nFaces"))
        faces = numbers_of(mesh / "faces", int).reshape(-1, 4)[first:first + count, 1:].ravel()
        # OpenFOAM numbers the nodes of a patch in the order in which its faces name them.
        nodes = faces[numpy.sort(numpy.unique(faces, return_index=True)[1])]
        write("0/pointDisplacement", "pointVectorField", "dimensions [0 1 0 0 0 0 0];\n"
              "internalField uniform (0 0 0);\nboundaryField { defaultFaces { type fixedValue;\n"
              f"value nonuniform List<vector> {as_list((moved - points)[nodes])}; }} }}\n")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run("moveMesh")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        result = numbers_of(case / "1/polyMesh/points", float).reshape(-1, 3)
    return result, seconds, f"OpenFOAM {version}"


def main():
    name, reference, moved, target = sys.argv[1:]
    points, cells = read(reference)
    wanted = read(moved)[0]
    result, seconds, version = {"laplace": laplace, "openfoam": openfoam}[name](
        points, cells, wanted)
    nodes = boundary_nodes(cells)
    assert numpy.abs(result[nodes] - wanted[nodes]).max() < 1e-9, "the boundary is elsewhere"
    numpy.savez(target, points=result, cells=cells)
    print(json.dumps({"seconds": seconds, "version": version}))


if __name__ == "__main__":
    main()
