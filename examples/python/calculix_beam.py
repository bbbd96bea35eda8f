"""A cantilever for CalculiX: gmsh's mesh is smoothed before its deck is written; ccx solves it.

Needs: gmsh
"""

import pathlib
import shutil
import subprocess

import gmsh

import meshsmooth as ms

gmsh.initialize(["gmsh", "-v", "2"])
beam = gmsh.model.occ.addBox(0, 0, 0, 10, 1, 1)
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(3, [beam], name="beam")
for name, x in (("clamp", 0), ("tip", 10)):
    ends = gmsh.model.getEntitiesInBoundingBox(x - 0.01, -1, -1, x + 0.01, 2, 2, dim=2)
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in ends], name=name)
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.4)
gmsh.model.mesh.generate(3)

print(ms.gmsh.smooth(goal="worst", boundary="slide"))

gmsh.option.setNumber("Mesh.SaveGroupsOfElements", -1000)  # of volumes alone
gmsh.option.setNumber("Mesh.SaveGroupsOfNodes", -100)  # of surfaces alone
gmsh.write("mesh.inp")
gmsh.finalize()
DECK = """*INCLUDE, INPUT=mesh.inp\n*MATERIAL, NAME=steel\n*ELASTIC\n210000, 0.3
*SOLID SECTION, ELSET=beam, MATERIAL=steel\n*BOUNDARY\nclamp, 1, 3
*STEP\n*STATIC\n*CLOAD\ntip, 3, -1\n*NODE PRINT, NSET=tip\nU\n*END STEP
"""
pathlib.Path("beam.inp").write_text(DECK)
if shutil.which("ccx"):
    subprocess.run(["ccx", "beam"], check=True, stdout=subprocess.DEVNULL)
    print(pathlib.Path("beam.dat").read_text())
