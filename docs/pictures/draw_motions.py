#!/usr/bin/env python3
"""Draws the picture of `move` in docs/methods.md: meshes before and after a motion.

    draw_motions.py MESHSMOOTH    a program with VTK and Gmsh; motions.png lands beside this file

Needs numpy, scipy, matplotlib, meshio, gmsh, and what tests/bench/motions/cases.py needs.
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "Agg")

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parents[1] / "tests" / "bench" / "motions"))

import meshes
import meshsmooth as ms

COLOURS = plt.get_cmap("viridis")
AT_REST = (0.93, 0.95, 0.96, 1)


def shape_kept(before, after):
    """The worst corner's mean ratio against the element before, 1 where it only turned or grew."""
    count = before.shape[1]
    worst = np.ones(len(before))
    for n in range(count):
        def edges(corners):
            return np.stack([corners[:, (n + 1) % count] - corners[:, n],
                             corners[:, n - 1] - corners[:, n]], axis=2)

        change = edges(after) @ np.linalg.inv(edges(before))
        ratio = 2 * np.linalg.det(change) / np.einsum("nij,nij->n", change, change)
        worst = np.minimum(worst, ratio)
    return worst


def draw(axes, reference, points, window, title, width):
    for rows in reference.cells.values():
        corners = points[rows][:, :, :2]
        kept = shape_kept(reference.points[rows][:, :, :2], corners)
        colours = COLOURS(np.clip(kept, 0, 1)) if points is not reference.points else [AT_REST]
        axes.add_collection(PolyCollection(corners, facecolors=colours, edgecolors="#26323a",
                                           linewidths=width))
    axes.set(xlim=window[:2], ylim=window[2:], aspect="equal")
    axes.axis("off")
    axes.set_title(title, fontsize=11)


def moved(reference, there):
    result = ms.move(reference.mesh, to=there, full=True)
    motion = result.summary.motion
    print(f"reached {motion.reached:.0%}, inverted "
          f"{result.summary.quality_after.inverted_element_count}")
    return result.points


def main(program):
    hub = meshes.generated(program, "hub", "--rows", 16)
    flap = meshes.generated(program, "flap", "--size", 0.015)
    lifted = meshes.generated(program, "flap", "--size", 0.015, "--tip", 0.8).points
    foil = meshes.aerofoil()
    pitched = foil.points.copy()
    pitched[foil.wall] = meshes.turned(foil.points[foil.wall], -20, (0.25, 0))
    pitched = moved(foil, pitched)

    figure = plt.figure(figsize=(13, 6.1), dpi=80)
    layout = figure.add_gridspec(2, 4, width_ratios=[0.9, 1.36, 1.2, 1.17], left=0.01, right=0.93,
                                 top=0.95, bottom=0.01, hspace=0.12, wspace=0.05)
    tail = meshes.turned(np.array([[1.0, 0, 0]]), -20, (0.25, 0))[0]
    columns = [
        (hub, moved(hub, meshes.turned_hub(hub.points, 60)), [(-1.03, 1.03, -1.03, 1.03)] * 2,
         ("a hub", "turned by 60°"), 0.4),
        (flap, moved(flap, lifted), [(0.12, 0.66, 0, 0.41)] * 2,
         ("a flap in a channel", "curved to 80 % of the free height"), 0.3),
        (foil, pitched, [(-0.35, 1.35, -0.7, 0.55)] * 2,
         ("an aerofoil", "pitched by 20°"), 0.25),
        (foil, pitched, [(0.93, 1.06, -0.05, 0.05),
                         (tail[0] - 0.07, tail[0] + 0.06, tail[1] - 0.05, tail[1] + 0.05)],
         ("its tail, 20 layers", "the layers follow"), 0.3),
    ]
    for column, (reference, after, windows, titles, width) in enumerate(columns):
        draw(figure.add_subplot(layout[0, column]), reference, reference.points, windows[0],
             titles[0], width)
        draw(figure.add_subplot(layout[1, column]), reference, after, windows[1], titles[1], width)
    scale = figure.add_axes([0.945, 0.06, 0.012, 0.34])
    bar = figure.colorbar(ScalarMappable(Normalize(0, 1), COLOURS), cax=scale)
    bar.ax.set_title("shape\nkept", fontsize=9)
    bar.outline.set_visible(False)
    figure.savefig(HERE / "motions.png")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
