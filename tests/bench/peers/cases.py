"""The meshes, the programs that run on them, and the columns of the tables."""

import json

import measure
import numpy

GOALS = {f"meshsmooth, `{goal}`": ["--goal", goal] for goal in ("average", "balanced", "worst")}
TETS = {
    "MFEM, TMOP metric 303": "mfem",
    "Gmsh, Relocate3D": "gmsh-relocate",
    "Gmsh, UntangleMeshGeometry": "gmsh-untangle",
    "MMG, moves only": "mmg-moves",
    "VTK, vtkConstrainedSmoothingFilter": "vtk-constrained",
    "Gmsh, default optimizer †": "gmsh-default",
    "Gmsh, Netgen †": "gmsh-netgen",
    "MMG, `optim` †": "mmg-optim",
}
# Enough for the large cube; some of the others take minutes there.
LARGE = {name: program for name, program in TETS.items()
         if program in ("gmsh-relocate", "vtk-constrained", "mmg-optim")}


def digits(value, count):
    return f"{value:.{count}f}".replace("-", "−")


def seconds(value):
    return digits(value, 2 if value < 10 else 1 if value < 100 else 0)


def tet_row(name, points, cells, domain, cost):
    found = measure.evaluate_tets(points, cells)
    # A mesh that overlaps itself has more volume than the domain.
    surplus = numpy.abs(measure.volumes(points, cells)).sum() / domain - 1
    return [name, f"{found['elements']:,}", f"{found['inverted']:,}",
            f"{digits(found['dihedral'], 2)}°", f"{digits(found['under10'], 3)} %",
            digits(found["worst"], 3), digits(found["mean"], 3),
            f"{digits(100 * surplus, 1)} %" if surplus > 5e-4 else "0",
            None if cost is None else seconds(cost)]


TET_COLUMNS = ["Program", "Tetrahedra", "Inverted", "Worst dihedral", "Under 10°",
               "Mean ratio: worst", "mean", "Overlap", "CPU s"]


def tets(runner, caption, arguments, ours, theirs):
    source = runner.generate("in.vtk", *arguments)
    points, cells = measure.read(source)
    domain = measure.volumes(points, cells).sum()
    rows = [tet_row("before", points, cells, domain, None)]
    for name, options in ours.items():
        cost = runner.meshsmooth("smooth", source, "-o", runner.file("out.vtk"), "--quiet",
                                 *options)
        rows.append(tet_row(name, *measure.read(runner.file("out.vtk")), domain, cost))
    for name, program in theirs.items():
        result = runner.foreign("programs.py", program, source, "OUT")
        if isinstance(result, str):
            rows.append([name, None, result, *[None] * (len(TET_COLUMNS) - 3)])
        else:
            rows.append(tet_row(name, result[0], result[1], domain, result[2]))
    return {"caption": caption, "columns": TET_COLUMNS, "rows": rows}


def cube10k(runner):
    return tets(runner, "`generate cube --nodes 10000`: random nodes, slivers. † changes the "
                "elements.", ["cube", "--nodes", 10000], GOALS, TETS)


def cube100k(runner):
    return tets(runner, "`generate cube --nodes 100000`; a choice of programs. † changes the "
                "elements.", ["cube", "--nodes", 100000], GOALS, LARGE)


def tangled(runner):
    ours = {"meshsmooth, `balanced`": []}
    return tets(runner, "`generate cube --nodes 10000 --tangle 0.3`: the same cube with interior "
                "nodes thrown about. Overlap: sum of the volumes' absolute values beyond the "
                "domain's.", ["cube", "--nodes", 10000, "--tangle", 0.3], ours, TETS)


HEX_PROGRAMS = {"mfem": "MFEM, TMOP metric 303, ideal shape",
                "mfem-reference": "MFEM, TMOP metric 303, shape of the reference",
                "vtk-constrained": "VTK, vtkConstrainedSmoothingFilter"}


def hexahedra(runner, plain, jitter, ours, foreign, row):
    """Rows of a jittered layer; `row` makes one of (program, positions, elements, CPU seconds)."""
    reference = runner.generate("reference.vtk", *plain)
    source = runner.generate("in.vtk", *plain, "--jitter", jitter)
    points, cells = measure.read(source)
    rows = [row("before", points, cells, None)]
    for name, options in ours.items():
        files = [reference if option == "REFERENCE" else option for option in options]
        cost = runner.meshsmooth("smooth", source, "-o", runner.file("out.vtk"), "--quiet", *files)
        rows.append(row(name, measure.read(runner.file("out.vtk"))[0], cells, cost))
    for program in foreign:
        extra = [reference] if program == "mfem-reference" else []
        result = runner.foreign("programs.py", program, source, "OUT", *extra)
        name = HEX_PROGRAMS[program]
        rows.append((name, result) if isinstance(result, str)
                    else row(name, result[0], cells, result[2]))
    return rows


def hex_row(name, moved, cells, cost):
    found = measure.evaluate_hexahedra(moved, cells)
    return [name, f"{found['inverted']:,}", digits(found["worst"], 3), digits(found["mean"], 3),
            None if cost is None else seconds(cost)]


def blocks(runner):
    rows = []
    for mesh, jitter in (("block", 0.2), ("tangled block", 0.4)):
        found = hexahedra(runner, ["layer", "--cells", "16x16x16", "--first", 0.0625, "--growth",
                                   1], jitter, {"meshsmooth": []}, ["mfem", "vtk-constrained"],
                          hex_row)
        rows += [[mesh, *row, *[None] * (5 - len(row))] for row in found]
    return {"caption": "A jittered block of 4,096 hexahedra, and the same with more jitter. "
            "Inverted: the Jacobian is not positive at one of 125 points.",
            "columns": ["Mesh", "Program", "Inverted", "Scaled Jacobian: worst", "mean", "CPU s"],
            "rows": rows}


def layers(runner):
    plain = ["layer", "--cells", "12x12x20"]
    wanted, cells = measure.read(runner.generate("reference.vtk", *plain))
    height = numpy.unique(wanted[:, 2].round(12))[1]
    first = numpy.abs(wanted[:, 2] - height) < 1e-9
    first[measure.boundary_nodes(cells)] = False

    def row(name, moved, cells, cost):
        ratio = moved[first, 2] / height
        share = f"{digits(100 * ratio.min(), 0)} to {digits(100 * ratio.max(), 0)} %"
        *found, cost = hex_row(name, moved, cells, cost)
        return [*found, share, cost]

    rows = hexahedra(runner, plain, 0.3,
                     {"meshsmooth": [], "meshsmooth, `--reference`": ["--reference", "REFERENCE"]},
                     ["mfem", "mfem-reference", "vtk-constrained"], row)
    return {"caption": "20 jittered layers of 144 hexahedra on a wall, the first 0.001 high "
            "(`generate layer --jitter 0.3`). Height of the first layer: of its inner nodes, "
            "against the mesh before the jitter.",
            "columns": ["Program", "Inverted", "Scaled Jacobian: worst", "mean",
                        "Height of the first layer", "CPU s"],
            "rows": [[*row, *[None] * (6 - len(row))] for row in rows]}


def surfaces(runner):
    axes = numpy.array([1, 1, 3])
    unit, cells = measure.sphere(5)
    points = unit * axes
    normals = unit / axes
    normals /= numpy.linalg.norm(normals, axis=1, keepdims=True)
    size = numpy.linalg.norm(points[cells[:, 0]] - points[cells[:, 1]], axis=1).mean()
    noise = 0.2 * size * numpy.random.default_rng(1).standard_normal(len(points))
    noisy = points + noise[:, None] * normals
    numpy.savez(runner.file("noisy.npz"), points=noisy, cells=cells)
    measure.write_surface(runner.file("noisy.vtp"), noisy, cells)

    def row(name, moved, cost):
        # Distance from the ellipsoid to first order: its function over the length of the gradient.
        scaled = moved / axes
        lengths = numpy.linalg.norm(scaled / axes, axis=1)
        distance = ((scaled ** 2).sum(axis=1) - 1) / (2 * lengths)
        error = numpy.sqrt((distance ** 2).mean())
        volume = measure.enclosed(moved, cells) / measure.enclosed(points, cells) - 1
        length = numpy.ptp(moved[:, 2]) / numpy.ptp(points[:, 2]) - 1
        return [name, digits(100 * error / size, 1) + " %", digits(100 * volume, 2) + " %",
                digits(100 * length, 2) + " %", None if cost is None else digits(cost, 2)]

    rows = [row("before", noisy, None)]
    for method in ("windowed-sinc", "taubin", "hc-laplacian"):
        cost = runner.meshsmooth("smooth", runner.file("noisy.vtp"), "-o", runner.file("out.vtp"),
                                 "--quiet", "--method", method)
        moved, _ = measure.read_surface(runner.file("out.vtp"))
        rows.append(row(f"meshsmooth, `{method}`", moved, cost))
    for name, program in (("VTK and PyVista, windowed sinc", "vtk:vtkWindowedSincPolyDataFilter"),
                          ("VTK and PyVista, Laplacian", "vtk:vtkSmoothPolyDataFilter"),
                          ("trimesh, Taubin", "trimesh:taubin"),
                          ("trimesh, Humphrey (HC)", "trimesh:humphrey"),
                          ("trimesh, Laplacian", "trimesh:laplacian"),
                          ("PyMeshLab, Taubin", "pymeshlab:taubin"),
                          ("PyMeshLab, HC", "pymeshlab:hc")):
        result = runner.foreign("surfaces.py", program, runner.file("noisy.npz"), "OUT")
        rows.append([name, result, None, None, None] if isinstance(result, str)
                    else row(name, result[0], result[2]))
    return {"caption": f"An ellipsoid of {len(points):,} nodes, half axes 1, 1 and 3, with normal "
            "noise of 20 % of the mean edge (standard deviation); 20 iterations, else each filter's "
            "defaults. Distance: root mean square of the nodes' distances from the ellipsoid, as a "
            "share of the mean edge. Volume and length: against the ellipsoid without noise.",
            "columns": ["Filter", "Distance", "Volume", "Length", "CPU s"], "rows": rows}


def motions(runner):
    rows = []
    hub = ["hub", "--rows", 17, "--layers", 17]
    cube = ["cube", "--nodes", 10000]
    for name, arguments, degrees in (("hub by 30°", hub, 30), ("hub by 60°", hub, 60),
                                     ("hub by 90°", hub, 90), ("cube with slivers, twisted by 90°",
                                                              cube, 90)):
        reference = runner.generate("reference.vtk", *arguments)
        points, cells = measure.read(reference)
        if arguments is hub:
            radius = numpy.linalg.norm(points[:, :2], axis=1)
            angle = numpy.radians(degrees) * (1 - radius) / (1 - radius.min())
            centre = 0.0
        else:
            angle, centre = numpy.radians(degrees) * points[:, 2], 0.5
        x, y = points[:, 0] - centre, points[:, 1] - centre
        turned = numpy.stack([centre + numpy.cos(angle) * x - numpy.sin(angle) * y,
                              centre + numpy.sin(angle) * x + numpy.cos(angle) * y,
                              points[:, 2]], axis=1)
        inside = numpy.ones(len(points), bool)
        inside[measure.boundary_nodes(cells)] = False
        turned[inside] = points[inside]
        goal = runner.file("goal.vtk")
        measure.write(goal, turned, cells)

        def row(program, moved, reached, cost, name=name, cells=cells):
            found = measure.evaluate_tets(moved, cells)
            return [name, program, reached, f"{found['inverted']:,}", digits(found["worst"], 3),
                    digits(found["mean"], 3), seconds(cost)]

        report = runner.file("report.json")
        cost = runner.meshsmooth("move", reference, "--to", goal, "-o", runner.file("out.vtk"),
                                 "--quiet", "--report", report)
        reached = json.loads(report.read_text())["motion"]["reached"]
        rows.append(row("meshsmooth, `move`", measure.read(runner.file("out.vtk"))[0],
                        f"{100 * reached:.3g} %", cost))
        for program, script in (("OpenFOAM, displacementLaplacian", "openfoam"),
                                ("SciPy, Laplace equation", "laplace")):
            result = runner.foreign("motion.py", script, reference, goal, "OUT")
            rows.append([name, program, None, result, None, None, None] if isinstance(result, str)
                        else row(program, result[0], "100 %", result[2]))
    return {"caption": "All boundary nodes are moved in one jump (hub: 22,032 nodes, each turned "
            "the less the farther out it lies; cube: 10,000).",
            "columns": ["Motion", "Program", "Reached", "Inverted", "Mean ratio: worst", "mean",
                        "CPU s"], "rows": rows}


TABLES = {"cube10k": cube10k, "cube100k": cube100k, "tangled": tangled, "blocks": blocks,
          "layers": layers, "motions": motions, "surfaces": surfaces}
