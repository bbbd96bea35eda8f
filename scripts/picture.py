#!/usr/bin/python3
"""Draws a mesh before and after smoothing: half of it cut away, coloured by
element quality, and the quality histogram of both.

    picture.py BEFORE.vtu AFTER.vtu -o OUT.png

Needs python3-vtk9, python3-numpy and python3-matplotlib, and no display.
"""

import argparse
import os
import sys

os.environ.setdefault("MPLBACKEND", "Agg")

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.patches import Patch
from vtkmodules.numpy_interface import dataset_adapter
from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkSelection, vtkSelectionNode
from vtkmodules.vtkFiltersExtraction import vtkExtractSelection
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

INVERTED = "#e4003a"
BEFORE = "#8d99ae"
AFTER = "#1b7f79"
COLOURS = plt.get_cmap("viridis")
VIEW = np.array([-0.55, -1.0, 0.55])  # towards the eye
LIGHT = np.array([-0.75, -0.9, 1.0])

ROOT_3 = np.sqrt(3.0)
EQUILATERAL = np.array([[1, 0.5, 0], [0, ROOT_3 / 2, 0], [0, 0, 1]])
REGULAR = np.array([[1, 0.5, 0.5], [0, ROOT_3 / 2, ROOT_3 / 6], [0, 0, np.sqrt(2 / 3)]])
EQUAL_EDGED = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, np.sqrt(0.5)]])

# VTK cell type: corners as (node, three neighbours), ideal edge vectors as columns.
CELLS = {
    10: ([(0, 1, 2, 3)], REGULAR),
    14: ([(0, 1, 3, 4), (1, 2, 0, 4), (2, 3, 1, 4), (3, 0, 2, 4)], EQUAL_EDGED),
    13: ([(0, 2, 1, 3), (1, 0, 2, 4), (2, 1, 0, 5), (3, 4, 5, 0), (4, 5, 3, 1), (5, 3, 4, 2)],
         EQUILATERAL),
    12: ([(0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7),
          (4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3)], np.eye(3)),
}


def mean_ratio(corners, cell_type):
    """Worst corner's signed mean ratio of elements [n, nodes, 3]."""
    rule, ideal = CELLS[cell_type]
    worst = np.full(len(corners), np.inf)
    for node, a, b, c in rule:
        edges = np.stack([corners[:, n] - corners[:, node] for n in (a, b, c)], axis=2)
        shape = edges @ np.linalg.inv(ideal)
        volume = np.linalg.det(shape)
        size = np.einsum("nij,nij->n", shape, shape)
        worst = np.minimum(worst, np.sign(volume) * 3 * np.abs(volume) ** (2 / 3) / size)
    return worst


def read(path):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    if grid.GetNumberOfCells() == 0:
        sys.exit(f"picture.py: {path}: there are no elements in it")
    return grid


def measure(grid):
    """Quality of all volume elements, and their cell ids."""
    data = dataset_adapter.WrapDataObject(grid)
    points = np.asarray(data.Points, dtype=float)
    types = np.asarray(data.CellTypes)
    nodes = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    starts = vtk_to_numpy(grid.GetCells().GetOffsetsArray())
    quality = np.full(len(types), np.nan)
    heights = np.full(len(types), np.nan)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    for cell_type, (rule, _) in CELLS.items():
        chosen = np.flatnonzero(types == cell_type)
        width = {10: 4, 14: 5, 13: 6, 12: 8}[cell_type]
        corners = points[nodes[starts[chosen][:, None] + np.arange(width)]]
        quality[chosen] = mean_ratio(corners, cell_type)
        heights[chosen] = corners[:, :, 1].mean(axis=1) - middle[1]
    if np.isnan(quality).all():
        sys.exit("picture.py: there are no volume elements to draw")
    return quality, np.flatnonzero(heights >= 0)


def cut_surface(grid, quality, kept):
    """Polygons of what is left of the mesh, with the quality of their elements."""
    node = vtkSelectionNode()
    node.SetFieldType(vtkSelectionNode.CELL)
    node.SetContentType(vtkSelectionNode.INDICES)
    node.SetSelectionList(numpy_to_vtkIdTypeArray(kept.astype(np.int64), deep=True))
    selection = vtkSelection()
    selection.AddNode(node)
    extract = vtkExtractSelection()
    extract.SetInputData(0, grid)
    extract.SetInputData(1, selection)
    surface = vtkDataSetSurfaceFilter()
    surface.SetInputConnection(extract.GetOutputPort())
    surface.PassThroughCellIdsOn()
    surface.Update()
    faces = surface.GetOutput()
    points = vtk_to_numpy(faces.GetPoints().GetData()).astype(float)
    polygons = faces.GetPolys()
    nodes = vtk_to_numpy(polygons.GetConnectivityArray())
    starts = vtk_to_numpy(polygons.GetOffsetsArray())
    owners = kept[vtk_to_numpy(faces.GetCellData().GetArray("vtkOriginalCellIds"))]
    return [points[nodes[a:b]] for a, b in zip(starts[:-1], starts[1:])], quality[owners]


def draw_mesh(axes, polygons, quality, title):
    eye = VIEW / np.linalg.norm(VIEW)
    right = np.cross([0, 0, 1], eye)
    right /= np.linalg.norm(right)
    up = np.cross(eye, right)
    light = LIGHT / np.linalg.norm(LIGHT)

    centres = np.array([polygon.mean(axis=0) for polygon in polygons])
    normals = np.array([np.cross(p[1] - p[0], p[-1] - p[0]) for p in polygons])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-300
    # An inverted element turns its faces inside out; all others are culled by them.
    shown = np.flatnonzero((normals @ eye > 0) | (quality <= 0))
    order = shown[np.argsort(centres[shown] @ eye)]

    colours = COLOURS(np.clip(quality, 0, 1))
    colours[quality <= 0] = plt.matplotlib.colors.to_rgba(INVERTED)
    shade = 0.72 + 0.28 * np.abs(normals @ light)
    colours[:, :3] *= np.where(quality <= 0, 1.0, shade)[:, None]
    flat = [np.stack([polygons[i] @ right, polygons[i] @ up], axis=1) for i in order]
    axes.add_collection(PolyCollection(flat, facecolors=colours[order],
                                       edgecolors=colours[order] * [0.6, 0.6, 0.6, 1.0],
                                       linewidths=0.15))
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_title(title, fontsize=15, fontweight="bold", pad=4)


def facts(quality):
    inverted = int((quality <= 0).sum())
    return (f"{len(quality):,} elements · inverted {inverted:,} ({100 * inverted / len(quality):.2f} %)"
            f"\nmean ratio: mean {quality.mean():.3f} · 1 % below {np.quantile(quality, 0.01):.3f}"
            f" · worst {quality.min():.4f}")


def draw_histogram(axes, before, after):
    lower = min(0.0, np.floor(10 * min(before.min(), after.min())) / 10)
    bins = np.linspace(lower, 1, int(round((1 - lower) / 0.02)) + 1)
    axes.hist(before, bins, color=BEFORE, alpha=0.75, label="before")
    axes.hist(after, bins, color=AFTER, histtype="stepfilled", alpha=0.35)
    axes.hist(after, bins, color=AFTER, histtype="step", linewidth=2, label="after")
    if lower < 0:
        axes.axvspan(lower, 0, color=INVERTED, alpha=0.08, linewidth=0)
        axes.text(lower / 2, 0.93, "inverted", color=INVERTED, ha="center",
                  transform=axes.get_xaxis_transform(), fontsize=11)
    axes.set_xlim(lower, 1)
    axes.set_xlabel("mean ratio (1 = ideal, below 0 = inverted)", fontsize=11)
    axes.set_ylabel("elements", fontsize=11)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:,.0f}")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=12, loc="upper left")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("before")
    parser.add_argument("after")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()

    figure = plt.figure(figsize=(15, 11.2), dpi=120, facecolor="white")
    layout = figure.add_gridspec(2, 2, height_ratios=[2.35, 1], hspace=0.22, wspace=0.02,
                                 left=0.06, right=0.97, top=0.95, bottom=0.06)
    qualities = []
    for column, (path, name) in enumerate([(arguments.before, "Before"), (arguments.after, "After")]):
        grid = read(path)
        quality, kept = measure(grid)
        axes = figure.add_subplot(layout[0, column])
        draw_mesh(axes, *cut_surface(grid, quality, kept), name)
        quality = quality[~np.isnan(quality)]
        axes.text(0.5, -0.005, facts(quality), ha="center", va="top", fontsize=11.5,
                  transform=axes.transAxes, linespacing=1.5)
        qualities.append(quality)
    draw_histogram(figure.add_subplot(layout[1, :]), *qualities)

    scale = figure.add_axes([0.4925, 0.5, 0.012, 0.36])
    bar = figure.colorbar(ScalarMappable(Normalize(0, 1), COLOURS), cax=scale)
    bar.ax.set_title("mean\nratio", fontsize=10)
    bar.outline.set_visible(False)
    figure.legend(handles=[Patch(color=INVERTED, label="inverted")], frameon=False, fontsize=10,
                  loc="upper center", bbox_to_anchor=(0.5, 0.49))
    figure.savefig(arguments.output)


if __name__ == "__main__":
    main()
