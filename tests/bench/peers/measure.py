"""Evaluates meshes independently of meshsmooth: NumPy, and VTK's Verdict for scaled Jacobians."""

import pathlib
import sys

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from verdict import dihedral_angles, volumes  # noqa: E402, beside VTK's Verdict

TETRA, HEXAHEDRON = vtk.VTK_TETRA, vtk.VTK_HEXAHEDRON
# Signs of the corners of a hexahedron in VTK's order.
CORNERS = numpy.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1],
                       [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
SAMPLES = 5  # of the Jacobian of a hexahedron, in each direction


def read(path):
    """Returns positions [nodes, 3] and elements [elements, 4 or 8] of a VTK file."""
    reader = vtk.vtkUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    if grid.GetNumberOfCells() == 0:
        sys.exit(f"{path}: no mesh")
    points = vtk_to_numpy(grid.GetPoints().GetData()).astype(float)
    cells = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).astype(numpy.int64)
    width = grid.GetCell(0).GetNumberOfPoints()
    return points, cells.reshape(-1, width)


def write(path, points, cells):
    """Writes a binary VTK file."""
    writer = vtk.vtkUnstructuredGridWriter()
    writer.SetFileVersion(42)  # which VTK 9.1 reads
    writer.SetFileTypeToBinary()
    writer.SetFileName(str(path))
    writer.SetInputData(make_grid(points, cells))
    writer.Write()


def make_grid(points, cells):
    grid = vtk.vtkUnstructuredGrid()
    own = vtk.vtkPoints()
    own.SetData(numpy_to_vtk(numpy.ascontiguousarray(points), deep=True))
    grid.SetPoints(own)
    width = cells.shape[1]
    array = vtk.vtkCellArray()
    offsets = numpy.arange(0, cells.size + 1, width)
    array.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True),
                  numpy_to_vtkIdTypeArray(numpy.ascontiguousarray(cells).ravel(), deep=True))
    grid.SetCells({3: vtk.VTK_TRIANGLE, 4: TETRA, 8: HEXAHEDRON}[width], array)
    return grid


# Facets by the number of an element's nodes, turned outward.
FACETS = {4: [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
          8: [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]}


def boundary_facets(cells):
    """Facets that one element uses, in the order of the elements."""
    facets = numpy.stack([cells[:, facet] for facet in FACETS[cells.shape[1]]], axis=1)
    facets = facets.reshape(-1, facets.shape[2])
    _, first, counts = numpy.unique(numpy.sort(facets, axis=1), axis=0, return_index=True,
                                    return_counts=True)
    return facets[numpy.sort(first[counts == 1])]


def boundary_nodes(cells):
    return numpy.unique(boundary_facets(cells))


def mean_ratios(points, tets):
    """12 (3 V)^(2/3) / (sum of squared edges): 1 regular, 0 flat, below 0 inverted."""
    volume = volumes(points, tets)
    edges = sum(((points[tets[:, a]] - points[tets[:, b]]) ** 2).sum(axis=1)
                for a in range(4) for b in range(a))
    return numpy.sign(volume) * 12 * (3 * numpy.abs(volume)) ** (2 / 3) / edges


def scaled_jacobians(points, cells):
    """By VTK's Verdict: the least of the corners."""
    quality = vtk.vtkMeshQuality()
    quality.SetInputData(make_grid(points, cells))
    quality.SetTetQualityMeasureToScaledJacobian()
    quality.SetHexQualityMeasureToScaledJacobian()
    quality.Update()
    return vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality"))


def least_jacobians(points, hexahedra):
    """The least Jacobian determinant of each hexahedron on a lattice that includes its corners."""
    corners = points[hexahedra]
    least = numpy.full(len(hexahedra), numpy.inf)
    steps = numpy.linspace(-1, 1, SAMPLES)
    for r in steps:
        for s in steps:
            for t in steps:
                factor = 1 + CORNERS * [r, s, t]
                gradient = numpy.stack([CORNERS[:, 0] * factor[:, 1] * factor[:, 2],
                                        CORNERS[:, 1] * factor[:, 0] * factor[:, 2],
                                        CORNERS[:, 2] * factor[:, 0] * factor[:, 1]]) / 8
                matrices = numpy.einsum("dc,ncx->ndx", gradient, corners)
                least = numpy.minimum(least, numpy.linalg.det(matrices))
    return least


def evaluate_tets(points, tets):
    volume = volumes(points, tets)
    with numpy.errstate(invalid="ignore", divide="ignore"):
        least = numpy.nan_to_num(dihedral_angles(points, tets).min(axis=1))
    least[volume <= 0] = 0
    ratio = mean_ratios(points, tets)
    return {"elements": len(tets), "inverted": int((volume <= 0).sum()),
            "dihedral": float(least.min()), "under10": float(100 * (least < 10).mean()),
            "worst": float(ratio.min()), "mean": float(ratio.mean())}


def evaluate_hexahedra(points, hexahedra):
    jacobian = scaled_jacobians(points, hexahedra)
    return {"elements": len(hexahedra),
            "inverted": int((least_jacobians(points, hexahedra) <= 0).sum()),
            "worst": float(jacobian.min()), "mean": float(jacobian.mean())}


def sphere(levels):
    """Returns nodes and triangles of the unit sphere: an icosahedron, halved `levels` times."""
    source = vtk.vtkPlatonicSolidSource()
    source.SetSolidTypeToIcosahedron()
    source.SetOutputPointsPrecision(vtk.vtkAlgorithm.DOUBLE_PRECISION)
    source.Update()
    points, cells = _surface(source.GetOutput())
    if enclosed(points, cells) < 0:
        cells = cells[:, ::-1]
    for _ in range(levels):
        edges = numpy.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, middle = numpy.unique(edges, axis=0, return_inverse=True)
        middle = middle.reshape(-1, 3) + len(points)
        points = numpy.concatenate([points, points[unique].mean(axis=1)])
        a, b, c = cells.T
        ab, bc, ca = middle.T
        cells = numpy.concatenate([numpy.stack(corners, axis=1) for corners in (
            (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
        points /= numpy.linalg.norm(points, axis=1, keepdims=True)
    return points, cells


def enclosed(points, triangles):
    """The volume that a closed surface encloses."""
    a, b, c = (points[triangles[:, n]] for n in range(3))
    return numpy.einsum("ij,ij->", a, numpy.cross(b, c)) / 6


def make_surface(points, cells):
    surface = vtk.vtkPolyData()
    grid = make_grid(points, cells)
    surface.SetPoints(grid.GetPoints())
    surface.SetPolys(grid.GetCells())
    return surface


def write_surface(path, points, cells):
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(make_surface(points, cells))
    writer.Write()


def read_surface(path):
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    return _surface(reader.GetOutput())


def _surface(surface):
    cells = vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).astype(numpy.int64)
    return vtk_to_numpy(surface.GetPoints().GetData()).astype(float), cells.reshape(-1, 3)
