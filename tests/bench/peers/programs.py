#!/usr/bin/env python3
"""Runs one foreign optimizer on a mesh, in a process of its own.

    programs.py NAME IN.vtk OUT.npz [REFERENCE.vtk]

OUT holds `points` and `cells`. The last line of stdout is JSON: the CPU seconds of the optimizer
alone (user and system, all threads; without imports, reading, writing and converting) and its
version. Boundary nodes are fixed wherever the program can fix them.
"""

import json
import sys
import time

import numpy
from measure import boundary_facets, boundary_nodes, make_grid, read


class Timer:
    """CPU seconds of this process, all threads."""

    def __enter__(self):
        self._start = time.process_time()
        return self

    def __exit__(self, *_):
        self.seconds = time.process_time() - self._start


def mfem(points, cells, reference):
    """TMOP: Newton and MINRES on all interior nodes at once, metric 303."""
    import importlib.metadata
    import tempfile

    import mfem.ser as mfem
    from mfem._ser.tmop_tools import TMOPNewtonSolver

    def load(positions):
        def rows_of(elements):
            geometry = {3: 2, 4: 4 if elements is cells else 3, 8: 5}[elements.shape[1]]
            rows = (f"1 {geometry} {' '.join(map(str, row))}\n" for row in elements.tolist())
            return f"{len(elements)}\n{''.join(rows)}"

        with tempfile.NamedTemporaryFile("w", suffix=".mesh") as file:
            nodes = "".join(" ".join(map(repr, p)) + "\n" for p in positions.tolist())
            file.write(f"MFEM mesh v1.0\n\ndimension\n3\n\nelements\n{rows_of(cells)}\n"
                       f"boundary\n{rows_of(boundary_facets(cells))}\n"
                       f"vertices\n{len(positions)}\n3\n{nodes}")
            file.flush()
            return mfem.Mesh(file.name, 1, 0, False)

    mesh = load(points)
    collection = mfem.H1_FECollection(1, 3)
    space = mfem.FiniteElementSpace(mesh, collection, 3)
    mesh.SetNodalFESpace(space)
    x = mfem.GridFunction(space)
    mesh.SetNodalGridFunction(x)
    target_points = mfem.GridFunction(space)
    target_points.Assign(points.T.ravel())
    tmop = mfem.tmop
    kind = tmop.TargetConstructor.IDEAL_SHAPE_UNIT_SIZE
    if reference is not None:
        kind = tmop.TargetConstructor.GIVEN_SHAPE_AND_SIZE
        target_points.Assign(reference.T.ravel())
    metric = tmop.TMOP_Metric_303()
    target = tmop.TargetConstructor(kind)
    target.SetNodes(target_points)
    integrator = tmop.TMOP_Integrator(metric, target)
    rules = mfem.IntegrationRules(0, mfem.Quadrature1D.GaussLobatto)
    # Linear tetrahedra have a constant Jacobian.
    order = 1 if cells.shape[1] == 4 else 4
    integrator.SetIntegrationRules(rules, order)
    form = mfem.NonlinearForm(space)
    form.AddDomainIntegrator(integrator)
    essential = mfem.intArray([1] * mesh.bdr_attributes.Max())
    form.SetEssentialBC(essential)
    linear = mfem.MINRESSolver()
    linear.SetMaxIter(100)
    linear.SetRelTol(1e-12)
    linear.SetAbsTol(0.0)
    jacobi = mfem.DSmoother(1)
    jacobi.SetPositiveDiagonal(True)
    linear.SetPreconditioner(jacobi)
    newton = TMOPNewtonSolver(rules.Get(mesh.GetElementBaseGeometry(0), order), 0)
    newton.SetIntegrationRules(rules, order)
    newton.SetPreconditioner(linear)
    newton.SetMaxIter(200)
    newton.SetRelTol(1e-5)
    newton.SetAbsTol(0.0)
    newton.SetPrintLevel(0)
    newton.SetOperator(form)
    zero = mfem.Vector(0)
    x.SetTrueVector()
    with Timer() as timer:
        newton.Mult(zero, x.GetTrueVector())
    x.SetFromTrueVector()
    moved = numpy.array(x.GetDataArray()).reshape(3, -1).T
    return moved, cells, timer, f"MFEM {importlib.metadata.version('mfem')}"


def gmsh_model(points, cells):
    """A discrete volume inside a discrete surface that holds the boundary's nodes."""
    import gmsh

    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.model.add("peer")
    surface = gmsh.model.addDiscreteEntity(2)
    volume = gmsh.model.addDiscreteEntity(3, -1, [surface])
    on_boundary = numpy.zeros(len(points), bool)
    on_boundary[boundary_nodes(cells)] = True
    for dimension, tag, chosen in ((2, surface, on_boundary), (3, volume, ~on_boundary)):
        nodes = numpy.flatnonzero(chosen)
        gmsh.model.mesh.addNodes(dimension, tag, nodes + 1, points[nodes].ravel())
    gmsh.model.mesh.addElementsByType(surface, 2, [], boundary_facets(cells).ravel() + 1)
    gmsh.model.mesh.addElementsByType(volume, 4, [], cells.ravel() + 1)
    return gmsh


def gmsh(points, cells, method, count):
    module = gmsh_model(points, cells)
    old, _ = module.model.mesh.getElementsByType(4)
    with Timer() as timer:
        module.model.mesh.optimize(method, True, count)
    tags, positions, _ = module.model.mesh.getNodes()
    order = numpy.zeros(int(tags.max()) + 1, numpy.int64)
    order[tags] = numpy.arange(len(tags))
    elements, nodes = module.model.mesh.getElementsByType(4)
    tets = order[nodes.astype(numpy.int64)].reshape(-1, 4)
    if method == "Netgen":  # in a discrete volume the old elements stay beside the new ones
        tets = tets[~numpy.isin(elements, old)]
    result = positions.reshape(-1, 3), tets
    version = module.option.getString("General.Version")
    module.finalize()
    return *result, timer, f"Gmsh {version}"


def mmg(points, cells, **options):
    import importlib.metadata

    import mmgpy

    mesh = mmgpy.MmgMesh3D(points, cells)
    with Timer() as timer:
        mesh.remesh(nosurf=1, verbose=-1, **options)
    return (mesh.get_vertices(), mesh.get_tetrahedra(), timer,
            f"MMG by mmgpy {importlib.metadata.version('mmgpy')}")


def vtk_constrained(points, cells):
    """vtkConstrainedSmoothingFilter, the boundary held by a constraint of length 0."""
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    grid = make_grid(points, cells)
    lengths = numpy.full(len(points), 1e30)
    lengths[boundary_nodes(cells)] = 0
    array = numpy_to_vtk(lengths, deep=True)
    array.SetName("SmoothingConstraints")
    grid.GetPointData().AddArray(array)
    smoother = vtk.vtkConstrainedSmoothingFilter()
    smoother.SetInputData(grid)
    smoother.SetConstraintStrategyToConstraintArray()
    smoother.SetNumberOfIterations(20)
    smoother.SetRelaxationFactor(1.0)
    smoother.SetOutputPointsPrecision(vtk.vtkAlgorithm.DOUBLE_PRECISION)
    with Timer() as timer:
        smoother.Update()
    moved = vtk_to_numpy(smoother.GetOutput().GetPoints().GetData())
    return moved, cells, timer, f"VTK {vtk.vtkVersion.GetVTKVersion()}"


PROGRAMS = {
    "mfem": lambda p, c, _: mfem(p, c, None),
    "mfem-reference": lambda p, c, reference: mfem(p, c, reference),
    "gmsh-relocate": lambda p, c, _: gmsh(p, c, "Relocate3D", 5),
    "gmsh-default": lambda p, c, _: gmsh(p, c, "", 1),
    "gmsh-netgen": lambda p, c, _: gmsh(p, c, "Netgen", 1),
    "gmsh-untangle": lambda p, c, _: gmsh(p, c, "UntangleMeshGeometry", 1),
    "mmg-moves": lambda p, c, _: mmg(p, c, noinsert=1, noswap=1, optim=1),
    "mmg-optim": lambda p, c, _: mmg(p, c, optim=1),
    "vtk-constrained": lambda p, c, _: vtk_constrained(p, c),
}


def main():
    name, source, target, *reference = sys.argv[1:]
    points, cells = read(source)
    wanted = read(reference[0])[0] if reference else None
    moved, result, timer, version = PROGRAMS[name](points, cells, wanted)
    numpy.savez(target, points=moved, cells=result)
    print(json.dumps({"seconds": timer.seconds, "version": version}))


if __name__ == "__main__":
    main()
