#!/usr/bin/env python3
"""Moves the same tetrahedral meshes by meshsmooth and by its peers, and evaluates the results.

    peers.py MESHSMOOTH [--tools NAME …] [--motions NAME …] [-o FILE.json]

Quality is computed here from the resulting points, not taken from any tool. Costs are CPU seconds
(user and system, of all threads) of the whole motion with its assembly, without reading files
where the tool lets one split that off. A tool whose package is missing is reported and left out.

Needs numpy, scipy, meshio, gmsh; KratosMeshMovingApplication, mfem (PyPI) and OpenFOAM (its
programs) for those peers.
"""

from __future__ import annotations

import argparse
import datetime
import json
import multiprocessing
import os
import resource
import subprocess
import sys
import tempfile
import traceback
from pathlib import Path

import meshes
import numpy as np
from cases import ROOT, git

PROGRAM = ""  # meshsmooth's command line, whose server is embedded
TOOLS = {}
STEPS = 10


def tool(name):
    def register(function):
        TOOLS[name] = function
        return function
    return register


# --- motions -------------------------------------------------------------------------------------


def good_cube(_program):
    """About 9,600 nodes, by Gmsh."""
    import gmsh

    gmsh.initialize(["cube", "-v", "1"])
    try:
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.0535)
        gmsh.model.mesh.generate(3)
        return meshes._read_gmsh(gmsh, 3)
    finally:
        gmsh.finalize()


def hub(rows):
    return lambda program: meshes.generated(program, "hub", "--rows", rows, "--layers", rows)


def random_cube(program):
    return meshes.generated(program, "cube", "--nodes", 10_000)


MOTIONS = {
    **{f"hub 20k by {degrees}°": (hub(17), meshes.turned_hub, degrees) for degrees in (30, 60, 90)},
    **{f"good cube, {name}": (good_cube, move, degrees)
       for name, move, degrees in [("curved by 120°", meshes.curved_cube, 120),
                                   ("twisted by 180°", meshes.twisted_cube, 180)]},
    **{f"random cube, {name}": (random_cube, move, degrees)
       for name, move, degrees in [("curved by 120°", meshes.curved_cube, 120),
                                   ("twisted by 180°", meshes.twisted_cube, 180)]},
    "hub 200k by 30°": (hub(36), meshes.turned_hub, 30),
    "hub 1M by 30°": (hub(63), meshes.turned_hub, 30),
}


def mean_ratios(points, tets):
    """Signed; 1 for regular tetrahedra."""
    edges = points[tets[:, 1:]] - points[tets[:, :1]]
    volume = np.linalg.det(edges) / 6
    squares = sum(((points[tets[:, i]] - points[tets[:, j]]) ** 2).sum(axis=1)
                  for i in range(4) for j in range(i))
    return np.sign(volume) * 12 * (3 * abs(volume)) ** (2 / 3) / squares


# --- tools: (reference, path) -> points; path(share): where the boundary's nodes lie -------------


def laplace_matrix(points, tets):
    import scipy.sparse

    inverse = np.linalg.inv(points[tets[:, 1:]] - points[tets[:, :1]])
    volume = abs(1 / np.linalg.det(inverse)) / 6
    gradients = np.concatenate([-inverse.sum(axis=2)[:, None], inverse.transpose(0, 2, 1)], axis=1)
    local = volume[:, None, None] * (gradients @ gradients.transpose(0, 2, 1))
    pairs = np.repeat(tets, 4, axis=1).ravel(), np.tile(tets, 4).ravel()
    return scipy.sparse.csr_matrix((local.ravel(), pairs), shape=(len(points),) * 2)


def laplace_step(points, tets, boundary, there):
    import scipy.sparse.linalg as linear

    matrix = laplace_matrix(points, tets)
    free = np.setdiff1d(np.arange(len(points)), boundary)
    u = np.zeros_like(points)
    u[boundary] = there - points[boundary]
    rows = matrix[free]
    inner, right = rows[:, free], -(rows @ u)
    scale = linear.LinearOperator(inner.shape, matvec=lambda v, d=1 / inner.diagonal(): d * v)
    for axis in range(3):
        u[free, axis], failed = linear.cg(inner, right[:, axis], rtol=1e-6, atol=0, M=scale)
        assert not failed
    result = points + u
    result[boundary] = there
    return result


@tool("SciPy CG, FE Laplace, one jump")
def laplace_jump(reference, path):
    return laplace_step(reference.points, reference.cells["tetra"], reference.boundary, path(1))


@tool("SciPy CG, FE Laplace, ten steps, matrix of the moving mesh")
def laplace_steps(reference, path):
    points = reference.points
    for step in range(1, STEPS + 1):
        points = laplace_step(points, reference.cells["tetra"], reference.boundary,
                              path(step / STEPS))
    return points


def kratos(kind):
    def move(reference, path):
        import KratosMultiphysics as kratos
        from KratosMultiphysics import MeshMovingApplication  # noqa: F401
        from KratosMultiphysics.MeshMovingApplication import python_solvers_wrapper_mesh_motion

        kratos.Logger.GetDefaultOutput().SetSeverity(kratos.Logger.Severity.WARNING)
        model = kratos.Model()
        part = model.CreateModelPart("mesh")
        part.ProcessInfo[kratos.DOMAIN_SIZE] = 3
        part.AddProperties(kratos.Properties(0))
        settings = kratos.Parameters(json.dumps({
            "problem_data": {"echo_level": 0, "parallel_type": "OpenMP", "start_time": 0.0,
                             "end_time": 1.0},
            "solver_settings": {
                "solver_type": kind, "model_part_name": "mesh", "domain_size": 3, "echo_level": 0,
                "time_stepping": {"time_step": 1.0}, "calculate_mesh_velocity": False,
                "model_import_settings": {"input_type": "use_input_model_part"}}}))
        solver = python_solvers_wrapper_mesh_motion.CreateSolver(model, settings)
        solver.AddVariables()
        for node, point in enumerate(reference.points):
            part.CreateNewNode(node + 1, *map(float, point))
        for element, nodes in enumerate(reference.cells["tetra"]):
            part.CreateNewElement("Element3D4N", element + 1, [int(n) + 1 for n in nodes],
                                  part.GetProperties(0))
        solver.ImportModelPart()
        solver.PrepareModelPart()
        solver.AddDofs()
        part.SetBufferSize(3)
        solver.Initialize()
        part.CloneTimeStep(1.0)
        displacement = path(1) - reference.points[reference.boundary]
        for node, value in zip(reference.boundary, displacement):
            given = part.Nodes[int(node) + 1]
            for name, component in zip("XYZ", value):
                variable = getattr(kratos, f"MESH_DISPLACEMENT_{name}")
                given.Fix(variable)
                given.SetSolutionStepValue(variable, 0, float(component))
        solver.InitializeSolutionStep()
        solver.SolveSolutionStep()
        solver.FinalizeSolutionStep()
        return np.array([[node.X, node.Y, node.Z] for node in part.Nodes])

    return move


tool("Kratos, structural similarity, one jump")(kratos("structural_similarity"))
tool("Kratos, Laplacian, one jump")(kratos("laplacian"))


@tool("MFEM TMOP (μ303, target: reference), from SciPy's ten steps")
def tmop(reference, path):
    import mfem.ser as mfem
    from mfem._ser import tmop as terms
    from mfem._ser import tmop_tools

    tets, points = reference.cells["tetra"], laplace_steps(reference, path)
    mesh = mfem.Mesh(3, len(points), len(tets), 0, 3)
    for point in reference.points:
        mesh.AddVertex(*map(float, point))
    for row in tets:
        mesh.AddTet(*map(int, row))
    mesh.FinalizeTetMesh(0, 0, False)
    space = mfem.FiniteElementSpace(mesh, mfem.H1_FECollection(1, 3), 3)
    mesh.SetNodalFESpace(space)
    nodes, rest = mesh.GetNodes(), mfem.GridFunction(space)
    rest.Assign(nodes)
    order = [space.DofToVDof(vertex, axis) for axis in range(3) for vertex in range(len(points))]
    nodes.GetDataArray()[order] = points.T.ravel()
    if not (mean_ratios(points, tets) > 0).all():
        raise RuntimeError("needs a valid start")
    target = terms.TargetConstructor(terms.TargetConstructor.GIVEN_SHAPE_AND_SIZE)
    target.SetNodes(rest)
    metric = terms.TMOP_Metric_303()
    integrator = terms.TMOP_Integrator(metric, target)
    rule = mfem.IntRules.Get(mfem.Geometry.TETRAHEDRON, 1)
    integrator.SetIntegrationRules(mfem.IntRules, 1)
    form = mfem.NonlinearForm(space)
    form.AddDomainIntegrator(integrator)
    integrator.thisown = False
    held = mfem.intArray([space.DofToVDof(int(node), axis) for node in reference.boundary
                          for axis in range(3)])
    form.SetEssentialVDofs(held)
    linear = mfem.MINRESSolver()
    linear.SetMaxIter(100)
    linear.SetRelTol(1e-12)
    jacobi = mfem.DSmoother(1, 1.0)
    jacobi.SetPositiveDiagonal(True)
    linear.SetPreconditioner(jacobi)
    solver = tmop_tools.TMOPNewtonSolver(rule, 0)
    solver.SetPreconditioner(linear)
    solver.SetMaxIter(100)
    solver.SetRelTol(1e-5)
    solver.SetOperator(form)
    nothing = mfem.Vector()
    solver.Mult(nothing, nodes)
    return nodes.GetDataArray()[order].reshape(3, -1).T.copy()


@tool("OpenFOAM displacementLaplacian, uniform, one jump")
def openfoam(reference, path):
    import foam

    return foam.move_mesh(reference.points, reference.cells["tetra"], reference.boundary, path(1))


@tool("meshsmooth move, one jump")
def own_jump(reference, path):
    import meshio

    with tempfile.TemporaryDirectory() as folder:
        there = reference.points.copy()
        there[reference.boundary] = path(1)
        for name, points in [("reference", reference.points), ("there", there)]:
            meshio.Mesh(points, reference.cells).write(f"{folder}/{name}.vtu", compression=None)
        ended = subprocess.run([PROGRAM, "move", f"{folder}/reference.vtu", "--to",
                                f"{folder}/there.vtu", "-o", f"{folder}/out.vtu"], check=False,
                               capture_output=True, text=True)
        if ended.returncode != 0:
            raise RuntimeError(ended.stderr or ended.stdout)
        return meshio.read(f"{folder}/out.vtu").points


# --- measuring -----------------------------------------------------------------------------------


def cpu_seconds():
    """Of this process and of those that it has waited for."""
    return sum(usage.ru_utime + usage.ru_stime for usage in
               (resource.getrusage(resource.RUSAGE_SELF),
                resource.getrusage(resource.RUSAGE_CHILDREN)))


def run_apart(name, reference, place, pipe):
    """In a process of its own: some peers end the interpreter, all leave memory behind."""
    try:
        before = cpu_seconds()
        points = TOOLS[name](reference, place)
        pipe.send((points, cpu_seconds() - before))
    except BaseException as error:  # what a peer throws is its result
        traceback.print_exc()
        pipe.send((None, str(error).splitlines()[0] if str(error) else type(error).__name__))


def measure(name, reference, place):
    receive, send = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(
        target=run_apart, args=(name, reference, place, send))
    process.start()
    send.close()
    try:
        points, cost = receive.recv()
    except EOFError:
        points, cost = None, "the process died"
    process.join()
    if points is None:
        return [cost, None, None, None, None]
    ratios = mean_ratios(points, reference.cells["tetra"])
    error = abs(points[reference.boundary] - place(1)).max()
    return [f"{int((ratios <= 0).sum()):,}", f"{ratios.min():.4f}", f"{ratios.mean():.4f}",
            f"{error:.0e}", f"{cost:.2g}" if cost < 10 else f"{cost:.0f}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--tools", nargs="+", choices=TOOLS, default=list(TOOLS))
    parser.add_argument("--motions", nargs="+", choices=MOTIONS, default=list(MOTIONS))
    parser.add_argument("-o", "--output", type=Path,
                        default=ROOT / "docs" / "results" / "motion-peers.json")
    arguments = parser.parse_args()
    global PROGRAM
    PROGRAM = arguments.program
    commit, today = git("rev-parse", "--short", "HEAD"), str(datetime.date.today())
    columns = ["Motion", "Tool", "Inverted", "Worst mean ratio", "Mean", "Error at the boundary",
               "CPU s"]
    run = {
        "title": "Motions by meshsmooth and its peers",
        "machine": "2 cores of a server, CPU backend",
        "command": "tests/bench/motions/peers.py MESHSMOOTH",
        "date": today, "commit": commit, "recorded": {"commit": commit, "date": today},
        "notes": "CPU seconds, user and system, less the interpreter's start; those of OpenFOAM "
                 "and meshsmooth are of their programs, with their files. The whole boundary is "
                 "prescribed.",
        "tables": {"outcome": {"caption": "The quality of all results by one evaluator.",
                               "columns": columns, "rows": []}},
    }
    rows = run["tables"]["outcome"]["rows"]
    if arguments.output.exists():
        rows += json.loads(arguments.output.read_text())["tables"]["outcome"]["rows"]
    for motion in arguments.motions:
        make, move, degrees = MOTIONS[motion]
        reference = make(arguments.program)
        start = reference.points[reference.boundary]

        def place(share, start=start, move=move, degrees=degrees):
            return move(start, share * degrees)

        for name in arguments.tools:
            row = [motion, name, *measure(name, reference, place)]
            print(row, flush=True)
            rows[:] = [old for old in rows if old[:2] != row[:2]] + [row]
            order = list(MOTIONS), list(TOOLS)
            rows.sort(key=lambda r: (order[0].index(r[0]), order[1].index(r[1])))
            arguments.output.write_text(json.dumps(run, indent=2, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    sys.exit(main())
