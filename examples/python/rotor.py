"""A rotor turns in a round housing for as long as it likes; the elements stay the same.

The housing's nodes lie on a regular polygon, so they may go along with the rotor in whole sides:
the mesh shears by half a side at most. Each step depends on the first mesh alone.

Needs: numpy
"""

import numpy as np

import meshsmooth as ms

AROUND, ROWS = 96, 12
angle = 2 * np.pi * np.arange(AROUND) / AROUND
circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
share = np.linspace(0, 1, ROWS + 1)[:, None, None] ** 1.3
points = ((1 - share) * circle * [0.7, 0.25] + share * circle).reshape(-1, 2)
row, i = np.divmod(np.arange(ROWS * AROUND), AROUND)
a, b = row * AROUND + i, row * AROUND + (i + 1) % AROUND
quads = np.stack([a, a + AROUND, b + AROUND, b], axis=1)
rotor, housing = np.arange(AROUND), np.arange(AROUND) + ROWS * AROUND
nodes = np.concatenate([rotor, housing])

with ms.default_client().session((points, {"quad": quads})) as session:
    for degrees in range(15, 361, 15):
        turn = np.radians(degrees)
        c, s = np.cos(turn), np.sin(turn)
        sides = round(degrees / 360 * AROUND)  # that the housing's nodes go along
        there = [points[rotor] @ np.array([[c, s], [-s, c]]), np.roll(circle, -sides, axis=0)]
        result = session.move(nodes, np.concatenate(there), full=True, quality="brief")
        motion, quality = result.summary.motion, result.summary.quality_after
        worst = quality.worst_elements[0].mean_ratio
        print(f"{degrees:4} degrees: reached {motion.reached:.0%}, worst mean ratio {worst:.2f}")
        assert motion.reached == 1
        assert quality.inverted_element_count == 0
