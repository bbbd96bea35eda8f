#!/usr/bin/python3
"""Draws the pictures of docs/methods.md: runs every method on a small mesh.

    draw.py MESHSMOOTH    the program; the pictures land beside this file

Needs python3-vtk9, python3-numpy and python3-matplotlib, and no display.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "Agg")

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import PolyCollection
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkFiltersModeling import vtkLoopSubdivisionFilter
from vtkmodules.vtkFiltersSources import vtkPlatonicSolidSource
from vtkmodules.vtkIOPLY import vtkPLYReader, vtkPLYWriter
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

HERE = Path(__file__).resolve().parent
LIGHT = np.array([-0.5, -0.7, 0.6])
VOLUME_RUNS = [
    ("Laplacian, guard off", "#e4003a", ["--method", "laplacian", "--guard", "off"]),
    ("Laplacian", "#f4a259", ["--method", "laplacian"]),
    ("smart Laplacian", "#1b7f79", ["--method", "smart-laplacian"]),
    ("optimize, balanced", "#274690", ["--method", "optimize"]),
    ("optimize, worst", "#7b2cbf", ["--method", "optimize", "--goal", "worst"]),
]
SURFACE_RUNS = [
    ("Laplacian", ["--method", "laplacian", "--guard", "off", "--iterations", "20"]),
    ("Taubin", ["--method", "taubin", "--guard", "off", "--iterations", "20"]),
    ("HC-Laplacian", ["--method", "hc-laplacian", "--guard", "off", "--iterations", "20"]),
]


def smooth(program, given, out, options):
    subprocess.run([program, "smooth", given, "-o", out, "--quiet", *options], check=True)


def tetrahedra(path):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    nodes = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4)
    return vtk_to_numpy(grid.GetPoints().GetData()).astype(float)[nodes]


def mean_ratio(corners):
    """Signed: 1 is ideal, below 0 inverted."""
    a, b, c = (corners[:, n] - corners[:, 0] for n in (1, 2, 3))
    volume = np.einsum("ni,ni->n", np.cross(a, b), c) / 6
    squares = sum(((corners[:, i] - corners[:, j]) ** 2).sum(axis=1)
                  for i in range(4) for j in range(i))
    return np.sign(volume) * 12 * (3 * np.abs(volume)) ** (2 / 3) / squares


def draw_volume(program, scratch):
    given = scratch / "cube.vtu"
    subprocess.run([program, "generate", "cube", "--nodes", "20000", "--seed", "1", "-o", given],
                   check=True, stdout=subprocess.DEVNULL)
    figure, axes = plt.subplots(figsize=(10, 4.2), dpi=110)
    bins = np.linspace(-0.3, 1, 66)
    before = mean_ratio(tetrahedra(given))
    axes.hist(before, bins, color="#8d99ae", alpha=0.6, label=f"before: worst {before.min():.3f}")
    for name, colour, options in VOLUME_RUNS:
        smooth(program, given, scratch / "out.vtu", options)
        after = mean_ratio(tetrahedra(scratch / "out.vtu"))
        label = f"{name}: mean {after.mean():.3f}, worst {after.min():.3f}"
        if (after <= 0).any():
            label += f", {100 * (after <= 0).mean():.1f} % inverted"
        axes.hist(after, bins, color=colour, histtype="step", linewidth=2, label=label)
    axes.axvspan(-0.3, 0, color="#e4003a", alpha=0.07, linewidth=0)
    axes.set_xlim(-0.3, 1)
    axes.set_xlabel("mean ratio (1 = ideal, below 0 = inverted)")
    axes.set_ylabel("elements")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="upper left")
    figure.tight_layout()
    figure.savefig(HERE / "volume.png")


def write_noisy_sphere(path):
    solid = vtkPlatonicSolidSource()
    solid.SetSolidTypeToIcosahedron()
    subdivide = vtkLoopSubdivisionFilter()
    subdivide.SetInputConnection(solid.GetOutputPort())
    subdivide.SetNumberOfSubdivisions(4)
    subdivide.Update()
    sphere = subdivide.GetOutput()
    places = vtk_to_numpy(sphere.GetPoints().GetData()).astype(np.float32)
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    places *= np.random.default_rng(1).normal(1, 0.02, (len(places), 1)).astype(np.float32)
    points = vtkPoints()
    points.SetData(numpy_to_vtk(places, deep=True))
    sphere.SetPoints(points)
    writer = vtkPLYWriter()
    writer.SetInputData(sphere)
    writer.SetFileName(str(path))
    writer.Write()


def triangles(path):
    reader = vtkPLYReader()
    reader.SetFileName(str(path))
    reader.Update()
    surface = reader.GetOutput()
    nodes = vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return vtk_to_numpy(surface.GetPoints().GetData()).astype(float)[nodes]


def enclosed(corners):
    spans = np.einsum("ni,ni->n", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2])
    return abs(spans.sum()) / 6


def draw_sphere(axes, corners, title):
    """Seen along +y, lit from the left above."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals *= np.sign((normals * corners.mean(axis=1)).sum())  # outwards
    shown = np.flatnonzero(normals[:, 1] < 0)
    shown = shown[np.argsort(-corners[shown].mean(axis=1)[:, 1])]
    shade = 0.35 + 0.65 * np.clip(normals[shown] @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
    colours = shade[:, None] * np.array([0.62, 0.86, 0.82])
    axes.add_collection(PolyCollection(corners[shown][:, :, [0, 2]], facecolors=colours,
                                       edgecolors=colours, linewidths=0.3))
    axes.add_patch(plt.Circle((0, 0), 1, fill=False, color="#e4003a", linewidth=1))
    axes.set(xlim=(-1.1, 1.1), ylim=(-1.1, 1.1), aspect="equal")
    axes.axis("off")
    axes.set_title(title, fontsize=11)


def draw_surface(program, scratch):
    given = scratch / "sphere.ply"
    write_noisy_sphere(given)
    figure, axes = plt.subplots(1, 4, figsize=(14, 4), dpi=80)
    before = triangles(given)
    draw_sphere(axes[0], before, "before")
    for place, (name, options) in zip(axes[1:], SURFACE_RUNS):
        smooth(program, given, scratch / "out.ply", options)
        after = triangles(scratch / "out.ply")
        share = 100 * enclosed(after) / enclosed(before)
        draw_sphere(place, after, f"{name}, 20 iterations\nvolume {share:.1f} %")
    figure.tight_layout()
    figure.savefig(HERE / "surface.png", bbox_inches="tight")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        draw_volume(sys.argv[1], Path(folder))
        draw_surface(sys.argv[1], Path(folder))
