"""A flap swings in a channel: each step sends the nodes of the flap alone, the mesh follows.

Needs: numpy
"""

import numpy as np

import meshsmooth as ms

SIDE = 42  # nodes
axis = np.linspace(-1, 1, SIDE)
points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
row, column = np.divmod(np.arange((SIDE - 1) ** 2), SIDE - 1)
quads = (row * SIDE + column)[:, None] + np.array([0, 1, SIDE + 1, SIDE])
is_flap = (row == 20) & (abs(column - 20) <= 8)  # no elements: a hole in the mesh
flap = np.unique(quads[is_flap])
hinge = np.array([points[flap, 0].min(), 0])

with ms.default_client().session((points, {"quad": quads[~is_flap]})) as session:
    for degrees in (10, 20, 30, 40, 30, 20, 10, 0, -10, -20, -30, -40, -30, -20, -10, 0):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        where = hinge + (points[flap] - hinge) @ np.array([[c, s], [-s, c]])
        result = session.move(flap, where, full=True, quality="brief")
        worst = result.summary.quality_after.worst_elements[0].mean_ratio
        reached = result.summary.motion.reached  # 1: the flap lies where it shall
        print(f"{degrees:4} degrees: reached {reached:.0%}, worst mean ratio {worst:.2f}")

# Steps depend on the first mesh alone, so the cycle ends where it began.
print(f"largest distance from the first mesh: {abs(result.mesh - points).max():.1e}")
