"""Where in a round room does a warm pipe lose the least heat? In its middle.

Each trial moves the pipe. The same shape has the same mesh, whatever was tried before.

Needs: numpy, scipy
"""

import numpy as np
import scipy.optimize
import scipy.sparse.linalg

import meshsmooth as ms

AROUND, ROWS = 64, 20
angle = 2 * np.pi * np.arange(AROUND) / AROUND
circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
first = (np.linspace(0.2, 1, ROWS + 1)[:, None, None] * circle).reshape(-1, 2)
a, i = np.arange(ROWS * AROUND), np.arange(ROWS * AROUND) % AROUND
b = a - i + (i + 1) % AROUND
triangles = np.stack([a, a + AROUND, b, b, a + AROUND, b + AROUND], axis=1).reshape(-1, 3)
pipe, wall, free = a[:AROUND], a[-AROUND:] + AROUND, a[AROUND:]


def heat_loss(offset):
    """From the pipe, at 1, to the wall, at 0, by linear finite elements."""
    x, y = np.moveaxis(session.move(pipe, first[pipe] + offset)[triangles], 2, 0)
    gy, gx = np.roll(y, -1, 1) - np.roll(y, 1, 1), np.roll(x, 1, 1) - np.roll(x, -1, 1)
    local = gy[:, :, None] * gy[:, None] + gx[:, :, None] * gx[:, None]
    local /= 2 * (gy * x).sum(axis=1)[:, None, None]
    pairs = np.repeat(triangles, 3, axis=1).ravel(), np.tile(triangles, 3).ravel()
    matrix = scipy.sparse.csr_matrix((local.ravel(), pairs))
    heat = np.isin(np.arange(len(first)), pipe).astype(float)
    heat[free] = scipy.sparse.linalg.spsolve(matrix[free][:, free], -(matrix @ heat)[free])
    return heat @ (matrix @ heat)


with ms.default_client().session((first, {"triangle": triangles}), fixed=wall) as session:
    # Sweeps end at a tolerance, so differences need a step that is well above its noise.
    found = scipy.optimize.minimize(heat_loss, [0.45, -0.3], method="BFGS", options={"eps": 1e-2})
print(f"{found.nfev} meshes: {np.hypot(*found.x):.1e} from the middle, loss {found.fun:.4f}")
