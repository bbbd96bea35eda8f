"""Which bar of a given area is stiffest in torsion? Found by derivatives of motions: the round one.

Needs: numpy
"""

import numpy as np

import meshsmooth as ms

RINGS, AROUND = 8, 48
angles = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
points = np.concatenate([[[0, 0]], *(r * circle / RINGS for r in range(1, RINGS + 1))])
ids = np.maximum(AROUND * np.arange(-1, RINGS)[:, None] + np.arange(AROUND) + 1, 0)
wall, to = ids[-1], np.roll(ids, -1, axis=1)
corners = [[ids[:-1], ids[1:], to[1:]], [ids[1:-1], to[2:], to[1:-1]]]
cells = np.concatenate([np.stack(three, axis=2).reshape(-1, 3) for three in corners])

k, phase = np.array([[2, 3, 4, 5] * 2]).T, np.pi / 2 * np.repeat([[0], [1]], 4, axis=0)
waves, shape = np.cos(k * angles - phase), np.array([0.25, -0.1, 0.05, 0, 0.1, 0.1, 0, -0.05])
with ms.Client().session((points, {"triangle": cells})) as session:
    for step in range(10):
        x = session.move(wall, (1 + shape @ waves)[:, None] * circle)
        # 2 ∫ u / area², where -Δu = 2 and u = 0 on the wall, by linear elements; its gradient.
        sides = x[np.roll(cells, -2, axis=1)] - x[np.roll(cells, -1, axis=1)]  # opposite corners
        normals = sides[..., ::-1] * [-1, 1]
        area = (sides[:, 1] * normals[:, 0]).sum(axis=1) / 2
        load, matrix, u, gradient = np.zeros(len(x)), np.zeros((len(x),) * 2), 0 * x[:, 0], 0 * x
        pairs = cells[:, :, None], cells[:, None, :]
        np.add.at(matrix, pairs, np.einsum("tik,tjk,t->tij", sides, sides, 0.25 / area))
        np.add.at(load, cells, 2 * area[:, None] / 3)
        u[: wall[0]] = np.linalg.solve(matrix[: wall[0], : wall[0]], load[: wall[0]])
        of, w, a = u[cells], np.einsum("ti,tik->tk", u[cells], sides), area.sum()
        by_area = 2 / 3 * of.sum(axis=1) + (w * w).sum(axis=1) / (8 * area**2) - load @ u / a
        by_side = (np.roll(of, -1, axis=1) - np.roll(of, -2, axis=1))[..., None] * w[:, None]
        by_corner = by_area[:, None, None] * normals - by_side / (2 * area[:, None, None])
        np.add.at(gradient, cells, by_corner / a**2)
        print(f"step {step}: {load @ u / a**2:.5f}; a round bar has {1 / (2 * np.pi):.5f}")
        shape += 2 / k[:, 0] * (waves @ (session.vjp(wall, gradient) * circle).sum(axis=1))
