"""A surface in PyVista, filled by TetGen, smoothed; point and cell arrays stay.

Needs: pyvista, tetgen
Writes: ball.vtu: tetra
"""

import pyvista as pv
import tetgen

import meshsmooth as ms

surface = pv.Sphere(theta_resolution=16, phi_resolution=16)
mesher = tetgen.TetGen(surface)
mesher.tetrahedralize(minratio=2.0)
grid = mesher.grid
grid.cell_data["part"] = [7] * grid.n_cells

result = ms.smooth(grid, full=True, element_quality="mean_ratio")

better = result.mesh  # a pyvista.UnstructuredGrid
assert (better["part"] == 7).all()
better.save("ball.vtu")
print(result.summary)
