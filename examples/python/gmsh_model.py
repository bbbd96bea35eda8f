"""The model that is open in gmsh: mesh, smooth, save; tags and physical groups stay.

Needs: gmsh
Writes: box.msh: triangle, tetra
"""

import gmsh

import meshsmooth as ms

gmsh.initialize(["gmsh", "-v", "2"])
model = gmsh.model.occ
ball = model.addSphere(0.5, 0.5, 0.5, 0.3)
volumes, _ = model.cut([(3, model.addBox(0, 0, 0, 1, 1, 1))], [(3, ball)])
model.synchronize()
inlet, *walls = [tag for _, tag in gmsh.model.getEntities(2)]
gmsh.model.addPhysicalGroup(2, [inlet], name="inlet")
gmsh.model.addPhysicalGroup(2, walls, name="walls")
gmsh.model.addPhysicalGroup(3, [tag for _, tag in volumes], name="fluid")
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.12)
gmsh.option.setNumber("Mesh.Optimize", 0)  # to leave something to do
gmsh.model.mesh.generate(3)

summary = ms.gmsh.smooth(goal="worst", boundary="slide", fixed="inlet")

gmsh.write("box.msh")
gmsh.finalize()
print(summary)
