"""A slider drags a hole and the mesh follows; colours show the quality. `… FILE.gif` draws that.

Needs: pyvista
"""

import os
import sys

import numpy as np
import pyvista as pv

import meshsmooth as ms

grid = pv.Disc(inner=0.4, outer=1, r_res=10, c_res=64)
start = grid.points.copy()
radius = np.linalg.norm(start, axis=1)
nodes = np.flatnonzero(np.isclose(radius, 0.4) | np.isclose(radius, 1))  # of hole and rim
session = grid.meshsmooth.session(method=ms.Move(start="warm"), element_quality="mean_ratio")


def drag(offset: float) -> None:
    """Moves the hole, and the mesh with it."""
    there = start[nodes] + np.outer(radius[nodes] < 0.5, [offset, 0, 0])
    result = session.move(nodes, there, full=True)
    grid.points, grid["quality"] = result.points, result.element_quality["mean_ratio"]
    print(f"{offset:+.2f}: worst mean ratio {grid['quality'].min():.2f}")


gif = sys.argv[1:]
window = pv.Plotter(off_screen=bool(gif) or not os.getenv("DISPLAY"), window_size=(360, 360))
slider = window.add_slider_widget(drag, (-0.55, 0.55), value=0, title="offset of the hole")
window.add_mesh(grid, clim=(0, 1), cmap="RdYlGn", show_edges=True, show_scalar_bar=False)
window.view_xy()
if gif:
    window.open_gif(gif[0], fps=10, palettesize=16)
for offset in 0.5 * np.sin(np.arange(0, 2 * np.pi, np.pi / 12)) if gif else ():
    slider.GetRepresentation().SetValue(offset)
    drag(offset)
    window.write_frame()
window.show()
