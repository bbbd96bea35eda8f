"""Meshes one .geo file by Gmsh and writes it in a choice of formats, versions and orders.

    gmsh_variants.py GEOMETRY FOLDER OFFSET

Every third of the variants below is written, from the one of the offset on.
"""

import pathlib
import sys

import gmsh

# Name, extension, order of the elements, options.
VARIANTS = [
    ("msh1", "msh", 1, {"Mesh.MshFileVersion": 1}),
    ("msh22", "msh", 1, {"Mesh.MshFileVersion": 2.2}),
    ("msh22_binary", "msh", 1, {"Mesh.MshFileVersion": 2.2, "Mesh.Binary": 1}),
    ("msh40", "msh", 1, {"Mesh.MshFileVersion": 4.0}),
    ("msh22_all", "msh", 1, {"Mesh.MshFileVersion": 2.2, "Mesh.SaveAll": 1}),
    ("msh41", "msh", 1, {"Mesh.MshFileVersion": 4.1}),
    ("msh41_binary", "msh", 1, {"Mesh.MshFileVersion": 4.1, "Mesh.Binary": 1}),
    ("msh41_all", "msh", 1, {"Mesh.MshFileVersion": 4.1, "Mesh.SaveAll": 1, "Mesh.SaveParametric": 1}),
    ("unv", "unv", 1, {}),
    ("unv_groups", "unv", 1, {"Mesh.SaveGroupsOfNodes": 1, "Mesh.SaveGroupsOfElements": 1}),
    ("free", "bdf", 1, {"Mesh.BdfFieldFormat": 0}),
    ("small", "bdf", 1, {"Mesh.BdfFieldFormat": 1}),
    ("large", "bdf", 1, {"Mesh.BdfFieldFormat": 2}),
    ("su2", "su2", 1, {}),
    ("medit", "mesh", 1, {}),
    ("abaqus", "inp", 1, {"Mesh.SaveGroupsOfNodes": 1}),
    ("legacy", "vtk", 1, {}),
    ("legacy_binary", "vtk", 1, {"Mesh.Binary": 1}),
    ("med", "med", 1, {}),
    ("cgns", "cgns", 1, {}),
    ("stl", "stl", 1, {}),
    ("stl_binary", "stl", 1, {"Mesh.Binary": 1}),
    ("msh22_second", "msh", 2, {"Mesh.MshFileVersion": 2.2}),
    ("msh40_second", "msh", 2, {"Mesh.MshFileVersion": 4.0}),
    ("msh41_second", "msh", 2, {"Mesh.MshFileVersion": 4.1}),
    ("msh41_second_serendipity", "msh", 2, {"Mesh.MshFileVersion": 4.1, "Mesh.SecondOrderIncomplete": 1}),
    ("unv_second", "unv", 2, {"Mesh.SecondOrderIncomplete": 1}),
    ("small_second", "bdf", 2, {"Mesh.BdfFieldFormat": 1, "Mesh.SecondOrderIncomplete": 1}),
    ("abaqus_second", "inp", 2, {"Mesh.SecondOrderIncomplete": 1}),
    ("legacy_second", "vtk", 2, {}),
    ("med_second", "med", 2, {}),
    ("cgns_second", "cgns", 2, {}),
]
DEFAULTS = {"Mesh.MshFileVersion": 4.1, "Mesh.Binary": 0, "Mesh.SaveAll": 0, "Mesh.SaveParametric": 0,
            "Mesh.SaveGroupsOfNodes": 0, "Mesh.SaveGroupsOfElements": 0, "Mesh.BdfFieldFormat": 1,
            "Mesh.SecondOrderIncomplete": 0}


def main():
    geometry, folder, offset = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), int(sys.argv[3])
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(str(geometry))
    gmsh.option.setNumber("Mesh.MeshSizeFactor", 2.5 * gmsh.option.getNumber("Mesh.MeshSizeFactor"))
    gmsh.model.mesh.generate(max(dimension for dimension, _ in gmsh.model.getEntities()))
    for order in (1, 2):
        wanted = [v for v in VARIANTS[offset % 3::3] if v[2] == order]
        for incomplete in (0, 1):
            chosen = [v for v in wanted if v[3].get("Mesh.SecondOrderIncomplete", 0) == incomplete]
            if not chosen:
                continue
            gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
            gmsh.model.mesh.setOrder(order)
            for name, extension, _, options in chosen:
                for option, value in {**DEFAULTS, **options}.items():
                    gmsh.option.setNumber(option, value)
                path = folder / f"{geometry.stem}-{name}.{extension}"
                try:
                    gmsh.write(str(path))
                except Exception:  # Gmsh has no other; the format cannot hold this mesh
                    path.unlink(missing_ok=True)
    gmsh.finalize()


if __name__ == "__main__":
    main()
