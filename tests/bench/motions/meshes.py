"""References with motions of their boundary, for cases.py and peers.py.

The references come from `meshsmooth generate` (read by meshio) and from Gmsh's own module.
"""

from __future__ import annotations

import dataclasses
import subprocess
import tempfile
from pathlib import Path

import meshio
import numpy as np
import scipy.spatial

FIRST_LAYER = 1e-4  # of the aerofoil's chord


@dataclasses.dataclass
class Reference:
    """Points [nodes, 3], blocks of elements by their names, and the boundary's nodes."""

    points: np.ndarray
    cells: dict[str, np.ndarray]
    boundary: np.ndarray
    wall: np.ndarray | None = None  # the nodes of a part that moves

    @property
    def mesh(self):
        return self.points, self.cells


FACETS = {
    "triangle": [(0, 1), (1, 2), (2, 0)],
    "quad": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tetra": [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)],
    "pyramid": [(0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
    "wedge": [(0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)],
    "hexahedron": [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6),
                   (3, 0, 4, 7)],
}


def boundary_nodes(cells):
    """The nodes of facets that one element alone has."""
    by_size = {}
    for name, rows in cells.items():
        for facet in FACETS[name]:
            by_size.setdefault(len(facet), []).append(np.asarray(rows)[:, list(facet)])
    found = []
    for facets in by_size.values():
        nodes = np.concatenate(facets)
        _, first, count = np.unique(np.sort(nodes, axis=1), axis=0, return_index=True,
                                    return_counts=True)
        found.append(nodes[first[count == 1]].ravel())
    return np.unique(np.concatenate(found))


def generated(program, *options):
    """The mesh of `meshsmooth generate OPTIONS`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.vtu"
        subprocess.run([program, "generate", *map(str, options), "-o", path], check=True,
                       stdout=subprocess.DEVNULL)
        read = meshio.read(path)
    cells = {block.type: block.data for block in read.cells}
    if "wedge" in cells:  # meshio's order is not that of the file, which is VTK's
        cells["wedge"] = cells["wedge"][:, [0, 2, 1, 3, 5, 4]]
    return Reference(read.points, cells, boundary_nodes(cells))


def turned(points, degrees, centre=(0, 0)):
    """Rotated about the z axis through `centre`; `degrees` may be one for each point."""
    angle = np.radians(degrees)
    c, s = np.cos(angle), np.sin(angle)
    x, y = (points[:, :2] - centre).T
    result = points.copy()
    result[:, 0] = centre[0] + c * x - s * y
    result[:, 1] = centre[1] + s * x + c * y
    return result


def turned_hub(points, degrees):
    """Where the points of a hub lie when its inner circle turns; in between the turn is linear."""
    return turned(points, degrees * (1 - np.hypot(points[:, 0], points[:, 1])) / 0.6)


def curved_cube(points, degrees):
    """The unit cube curved about z, by `degrees` from x = 0 to x = 1."""
    share = degrees / 120
    x, y = points[:, 0], points[:, 1]
    angle = np.radians(degrees) * x
    arm = 1 / np.radians(degrees) + (y - 0.5) * (1 - share / 2)
    result = points.copy()
    result[:, 0] = arm * np.sin(angle)
    result[:, 1] = arm * np.cos(angle) - 1 / np.radians(degrees) + 0.5
    return result


def twisted_cube(points, degrees):
    """The unit cube twisted about its upright axis."""
    return turned(points, degrees * points[:, 2], (0.5, 0.5))


def naca0012(count):
    """Half the nodes of the section, x and y ≥ 0 from the nose to the sharp tail."""
    x = 0.5 * (1 - np.cos(np.linspace(0, np.pi, count)))
    y = 0.6 * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    y[-1] = 0
    return x, y


def aerofoil(quads=True, layers=20, span_layers=0, growth=1.2, radius=5.0):
    """A NACA 0012 of chord 1 in a circle, with boundary layers by Gmsh; the section is its wall.

    `quads`: the layers are quads, the rest triangles; else triangles alone. `span_layers`: extruded
    to hexahedra and wedges, each layer 0.1 high.
    """
    import gmsh

    gmsh.initialize(["aerofoil", "-v", "1"])
    try:
        gmsh.model.add("aerofoil")
        geo = gmsh.model.geo
        x, y = naca0012(80)
        upper = [geo.addPoint(a, b, 0, 0.02) for a, b in zip(x, y)]
        lower = [upper[0], *(geo.addPoint(a, -b, 0, 0.02) for a, b in zip(x[1:-1], y[1:-1])),
                 upper[-1]]
        section = [geo.addSpline(upper), geo.addSpline(lower)]
        centre = geo.addPoint(0.5, 0, 0)
        far = [geo.addPoint(0.5 + radius * np.cos(a), radius * np.sin(a), 0, 0.6)
               for a in np.radians([0, 90, 180, 270])]
        circle = [geo.addCircleArc(far[i], centre, far[(i + 1) % 4]) for i in range(4)]
        surface = geo.addPlaneSurface([geo.addCurveLoop(circle),
                                       geo.addCurveLoop([section[0], -section[1]])])
        if span_layers:
            geo.extrude([(2, surface)], 0, 0, 0.1 * span_layers, [span_layers], recombine=True)
        geo.synchronize()
        for curve in section:
            gmsh.model.mesh.setTransfiniteCurve(curve, 100, "Bump", 0.15)
        field = gmsh.model.mesh.field.add("BoundaryLayer")
        number = gmsh.model.mesh.field.setNumber
        gmsh.model.mesh.field.setNumbers(field, "CurvesList", section)
        gmsh.model.mesh.field.setNumbers(field, "FanPointsList", [upper[-1]])
        number(field, "Size", FIRST_LAYER)
        number(field, "Ratio", growth)
        number(field, "Quads", int(quads))
        number(field, "Thickness", FIRST_LAYER * (growth**layers - 1) / (growth - 1) * 1.0001)
        gmsh.model.mesh.field.setAsBoundaryLayer(field)
        gmsh.model.mesh.generate(3 if span_layers else 2)
        reference = _read_gmsh(gmsh, 3 if span_layers else 2)
        own = [gmsh.model.mesh.getNodes(1, curve, includeBoundary=True)[1] for curve in section]
        profile = np.concatenate(own).reshape(-1, 3)[:, :2]
        distance, _ = scipy.spatial.cKDTree(profile).query(reference.points[:, :2])
        reference.wall = np.flatnonzero(distance < 1e-9)
        return reference
    finally:
        gmsh.finalize()


def _read_gmsh(gmsh, dimension):
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    points = coordinates.reshape(-1, 3)
    index = np.zeros(int(tags.max()) + 1, np.int64)
    index[tags.astype(np.int64)] = np.arange(len(tags))
    cells = {}
    names = {2: "triangle", 3: "quad", 4: "tetra", 5: "hexahedron", 6: "wedge"}
    for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dimension)):
        rows = index[nodes.astype(np.int64)].reshape(-1, {2: 3, 3: 4, 4: 4, 5: 8, 6: 6}[kind])
        # VTK lets the normal of a wedge's first triangle point out of the wedge, Gmsh into it.
        cells[names[kind]] = rows[:, [0, 2, 1, 3, 5, 4]] if kind == 6 else rows
    used = np.unique(np.concatenate([rows.ravel() for rows in cells.values()]))
    new = np.full(len(points), -1)
    new[used] = np.arange(len(used))
    cells = {name: new[rows] for name, rows in cells.items()}
    return Reference(points[used], cells, boundary_nodes(cells))


def edges(cells):
    """The edges of all elements, each once, [edges, 2]."""
    pairs = {
        "triangle": FACETS["triangle"], "quad": FACETS["quad"],
        "tetra": [(a, b) for a in range(4) for b in range(a)],
        "pyramid": [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)],
        "wedge": [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
        "hexahedron": [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4),
                       (1, 5), (2, 6), (3, 7)],
    }
    rows = np.concatenate([np.asarray(rows)[:, list(pair)]
                           for name, rows in cells.items() for pair in pairs[name]])
    return np.unique(np.sort(rows, axis=1), axis=0)
