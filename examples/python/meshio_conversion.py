"""From one file format to another by meshio, smoothed on the way; sets and cell data stay.

Needs: meshio
Writes: channel.vtu: quad
"""

import meshio
import numpy as np

import meshsmooth as ms

# A file to convert: quads between two lines, the nodes between them displaced.
x, y = np.meshgrid(np.linspace(0, 4, 33), np.linspace(0, 1, 9))
y[1:-1, 1:-1] += np.random.default_rng(1).uniform(-0.04, 0.04, y[1:-1, 1:-1].shape)
first = (np.arange(8)[:, None] * 33 + np.arange(32)).reshape(-1, 1)
quads = first + np.array([0, 1, 34, 33])
points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
material = (points[quads].mean(axis=1)[:, 0] > 2).astype(int)
meshio.Mesh(points, [("quad", quads)], cell_data={"material": [material]}).write("channel.vtk")

mesh = meshio.read("channel.vtk")
# The nodes on the line between the materials stay on it, as those on the boundary do.
result = ms.smooth(mesh, full=True, regions="material")
result.mesh.write("channel.vtu")
print(result.summary)
