"""A time-step loop: a session sends the elements once, every step sends positions only.

Needs: numpy
"""

import numpy as np

import meshsmooth as ms

SIDE = 41
axis = np.linspace(-1, 1, SIDE)
points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
first = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).reshape(-1, 1)
quads = first + np.array([0, 1, SIDE + 1, SIDE])
piston = np.abs(points).max(axis=1) < 0.3  # these nodes the simulation moves

with ms.default_client().session((points, {"quad": quads}), fixed=piston) as session:
    for step in range(10):
        points[piston] += [0.02, 0.0]
        result = session.smooth(points, out=points, full=True, quality="brief", iterations=20)
        before, after = result.summary.quality_before, result.summary.quality_after
        print(
            f"step {step}: worst mean ratio {before.worst_elements[0].mean_ratio:.2f} -> "
            f"{after.worst_elements[0].mean_ratio:.2f}, {after.inverted_element_count} inverted"
        )
