"""Cases of OpenFOAM: a NACA 0012 that pitches in a C-shaped grid of blockMesh."""

import math
from pathlib import Path

SCHEMES = """ddtSchemes { default Euler; } gradSchemes { default Gauss linear; } divSchemes { default none; }
laplacianSchemes { default Gauss linear corrected; } interpolationSchemes { default linear; }
snGradSchemes { default corrected; }"""
# As in the tutorials of moveDynamicMesh.
SOLUTION = """solvers { "cellDisplacement.*" { solver GAMG; smoother GaussSeidel; tolerance 1e-8; relTol 0; } }
PIMPLE { }"""
OURS = "motionSolverLibs (fvMotionSolvers meshsmoothMotion); motionSolver meshsmooth;"
# The mesh stays, all else is done: what the other solvers cost is beyond this.
REST = """motionSolver solidBody; solidBodyMotionFunction linearMotion; velocity (0 0 0);
linearMotionCoeffs { velocity (0 0 0); }"""
SIDES = {
    "empty": ("sides { type empty; faces (%s %s); }", "sides { type empty; }"),
    "cyclic": ("left { type cyclic; neighbourPatch right; faces (%s); } "
               "right { type cyclic; neighbourPatch left; faces (%s); }",
               "left { type cyclic; } right { type cyclic; }"),
}


def laplacian(diffusivity):
    return ("motionSolverLibs (fvMotionSolvers); motionSolver displacementLaplacian; "
            f"diffusivity {diffusivity};")


def half_thickness(x):
    return 0.6 * (0.2969 * math.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)


def section(first, last, sign, z, count=40):
    """Points of the section between two places of its chord, closer at its ends."""
    start, end = math.acos(1 - 2 * first), math.acos(1 - 2 * last)
    places = [0.5 * (1 - math.cos(start + (end - start) * i / count)) for i in range(1, count)]
    return " ".join(f"({x:.10g} {sign * half_thickness(x):.10g} {z})" for x in places)


def block_mesh_dict(along=30, wake=30, normal=40, layers=1, span=0.1, sides="empty"):
    """Six blocks about the section and behind it; the first cells are 5e-3 to 1e-3 chords high."""
    radius, slant = 5.0, 5.0 * math.sqrt(0.5)
    top, far = half_thickness(0.3), 1 + radius
    flat = [(0, 0), (1, 0), (far, 0), (1 - radius, 0), (1, radius), (far, radius), (1, -radius),
            (far, -radius), (0.3, top), (0.3, -top), (1 - slant, slant), (1 - slant, -slant)]
    quads = [((0, 8, 10, 3), along, 1), ((8, 1, 4, 10), along, 0.3), ((1, 2, 5, 4), wake, 20),
             ((9, 0, 3, 11), along, 1), ((1, 9, 11, 6), along, 1 / 0.3), ((2, 1, 6, 7), wake, 0.05)]
    above = len(flat)

    def side(a, b):
        return f"({a} {b} {b + above} {a + above})"

    def join(values):
        return " ".join(map(str, values))

    edges = []
    for z, shift in ((0, 0), (span, above)):
        for a, b, x, sign in ((0, 8, (0, 0.3), 1), (8, 1, (0.3, 1), 1), (0, 9, (0, 0.3), -1), (9, 1, (0.3, 1), -1)):
            edges.append(f"polyLine {a + shift} {b + shift} ({section(*x, sign, z)})")
        for a, b, degrees in ((3, 10, 157.5), (10, 4, 112.5), (3, 11, 202.5), (11, 6, 247.5)):
            angle = math.radians(degrees)
            edges.append(f"arc {a + shift} {b + shift} ({1 + radius * math.cos(angle):.10g} "
                         f"{radius * math.sin(angle):.10g} {z})")
    low = " ".join(f"({join(quad)})" for quad, _, _ in quads)
    high = " ".join(f"({join(v + above for v in quad)})" for quad, _, _ in quads)
    wall = " ".join(side(*pair) for pair in ((0, 8), (8, 1), (1, 9), (9, 0)))
    outer = " ".join(side(*pair) for pair in ((3, 10), (10, 4), (4, 5), (5, 2), (2, 7), (7, 6), (6, 11), (11, 3)))
    vertices = " ".join(f"({x:.10g} {y:.10g} {z})" for z in (0, span) for x, y in flat)
    blocks = " ".join(f"hex ({join(quad)} {join(v + above for v in quad)}) ({cells} {normal} {layers}) "
                      f"simpleGrading ({grade} 400 1)" for quad, cells, grade in quads)
    return f"""convertToMeters 1; vertices ({vertices}); blocks ({blocks}); edges ({' '.join(edges)});
boundary (aerofoil {{ type wall; faces ({wall}); }} far {{ type patch; faces ({outer}); }}
{SIDES[sides][0] % (low, high)});"""


def write(folder, name, kind, text):
    path = Path(folder) / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"FoamFile {{ version 2.0; format ascii; class {kind}; object {path.name}; }}\n{text}\n")


def write_case(folder, motion, degrees, steps=60, end=None, write_interval=1, sides="empty", **mesh):
    """A period of the pitch in `steps` steps, or its first ones to `end`."""
    write(folder, "system/blockMeshDict", "dictionary", block_mesh_dict(sides=sides, **mesh))
    write(folder, "system/controlDict", "dictionary",
          f"application moveDynamicMesh; startFrom startTime; startTime 0; stopAt endTime; endTime {end or steps}; "
          f"deltaT 1; writeControl timeStep; writeInterval {write_interval}; writeFormat binary; writePrecision 12;")
    write(folder, "system/fvSchemes", "dictionary", SCHEMES)
    write(folder, "system/fvSolution", "dictionary", SOLUTION)
    write(folder, "constant/dynamicMeshDict", "dictionary", f"dynamicFvMesh dynamicMotionSolverFvMesh; {motion}")
    write(folder, "0/pointDisplacement", "pointVectorField",
          "dimensions [0 1 0 0 0 0 0]; internalField uniform (0 0 0); boundaryField { "
          "aerofoil { type angularOscillatingDisplacement; axis (0 0 1); origin (0.25 0 0); angle0 0; "
          f"amplitude {math.radians(degrees):.12g}; omega {2 * math.pi / steps:.12g}; value uniform (0 0 0); }} "
          f"far {{ type fixedValue; value uniform (0 0 0); }} {SIDES[sides][1]} }}")
