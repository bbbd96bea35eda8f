"""A mesh of dolfinx: the triple of its plot module goes out, positions come back.

Needs: dolfinx
"""

import dolfinx.plot
import numpy as np
from mpi4py import MPI

import meshsmooth as ms

mesh = dolfinx.mesh.create_unit_cube(MPI.COMM_SELF, 8, 8, 8)
# The geometry's nodes; of a mesh of degree 1 they are the vertices, in an order of their own.
x = mesh.geometry.x
inner = ((x > 1e-9) & (x < 1 - 1e-9)).all(axis=1)
x[inner] += np.random.default_rng(1).uniform(-0.04, 0.04, (inner.sum(), 3))

# Before 0.7 the function was called create_vtk_mesh.
vtk_mesh = getattr(dolfinx.plot, "vtk_mesh", None) or dolfinx.plot.create_vtk_mesh
result = ms.smooth(vtk_mesh(mesh, mesh.topology.dim), full=True)

x[:] = result.points  # functions and tags on the mesh stay valid
print(result.summary)
