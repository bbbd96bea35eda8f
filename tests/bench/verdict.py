#!/usr/bin/env python3
"""Measures tetrahedral meshes independently of meshsmooth, and against their originals.

    verdict.py MESH.vtu [MESH.vtu ...] [--original MESH.vtu] [--max-inverted N]

Mean ratio (shape) and scaled Jacobian by VTK's Verdict; dihedral angles here, because
VTK 9.1's least angle of a tetrahedron leaves out two edges. With --original: whether the
connectivity is the same, and how far nodes of the boundary (of facets used once) have moved.
Exit code 1 when more elements than N are inverted.
"""

import argparse
import sys

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))


def read(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    if grid.GetNumberOfCells() == 0:
        sys.exit(f"{path}: no mesh")
    positions = vtk_to_numpy(grid.GetPoints().GetData()).astype(numpy.float64)
    nodes = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    return grid, positions, nodes.reshape(-1, 4)


def by_verdict(grid, measure):
    quality = vtk.vtkMeshQuality()
    quality.SetInputData(grid)
    quality.SetTetQualityMeasure(measure)
    quality.Update()
    return vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality"))


def dihedral_angles(positions, tets):
    """Degrees, tetrahedra x 6."""
    corners = positions[tets]
    angles = []
    for a, b in EDGES:
        c, d = (n for n in range(4) if n not in (a, b))
        axis = corners[:, b] - corners[:, a]
        axis /= numpy.linalg.norm(axis, axis=1)[:, None]
        sides = []
        for other in (c, d):
            side = corners[:, other] - corners[:, a]
            sides.append(side - numpy.einsum("ij,ij->i", side, axis)[:, None] * axis)
        cosine = numpy.einsum("ij,ij->i", *sides) / numpy.prod(
            [numpy.linalg.norm(side, axis=1) for side in sides], axis=0)
        angles.append(numpy.degrees(numpy.arccos(numpy.clip(cosine, -1, 1))))
    return numpy.stack(angles, axis=1)


def volumes(positions, tets):
    a, b, c, d = (positions[tets[:, n]] for n in range(4))
    return numpy.einsum("ij,ij->i", b - a, numpy.cross(c - a, d - a)) / 6


def boundary_nodes(tets):
    facets = numpy.sort(
        numpy.concatenate([tets[:, f] for f in ([0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3])]),
        axis=1)
    unique, counts = numpy.unique(facets, axis=0, return_counts=True)
    return numpy.unique(unique[counts == 1])


def main():
    arguments = argparse.ArgumentParser(description=__doc__,
                                        formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("meshes", nargs="+")
    arguments.add_argument("--original")
    arguments.add_argument("--max-inverted", type=int, default=0)
    options = arguments.parse_args()
    original = read(options.original) if options.original else None
    failed = False
    for path in options.meshes:
        grid, positions, tets = read(path)
        volume = volumes(positions, tets)
        inverted = int((volume <= 0).sum())
        least = dihedral_angles(positions, tets).min(axis=1)
        least[volume <= 0] = 0
        shape = numpy.where(volume > 0, by_verdict(grid, vtk.VTK_QUALITY_SHAPE), 0)
        jacobian = by_verdict(grid, vtk.VTK_QUALITY_SCALED_JACOBIAN)
        print(f"{path}: {len(tets)} tetrahedra, inverted {inverted}, "
              f"mean ratio mean {shape.mean():.4f} min {shape.min():.4f} "
              f"1% {numpy.quantile(shape, 0.01):.4f}, "
              f"worst dihedral {least.min():.2f} deg, under 10 deg {100 * (least < 10).mean():.4f} %, "
              f"scaled Jacobian min {jacobian.min():.4f}, "
              f"sum of |V| - sum of V {numpy.abs(volume).sum() - volume.sum():.3e}")
        failed |= inverted > options.max_inverted
        if original is None:
            continue
        _, before, tets_before = original
        if not numpy.array_equal(tets, tets_before):
            print(f"{path}: the connectivity differs from the original's")
            failed = True
            continue
        moved = numpy.abs(positions - before)[boundary_nodes(tets)].max()
        total = abs(numpy.abs(volume).sum() - abs(volumes(before, tets).sum()))
        print(f"{path}: the boundary moved by {moved:.3e} at most, the volume by {total:.3e}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
