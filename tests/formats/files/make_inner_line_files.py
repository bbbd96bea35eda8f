"""Makes the files beside it of plane meshes with a line inside, the side set or condition "fault":
inner_line.exo, inner_line_shells.exo, inner_line.cgns (by edges), inner_line_vertices.cgns,
inner_line.med.

    pip install netCDF4 h5py meshio; python3 make_inner_line_files.py

A square of 4 x 4 quads with the corners 0 and 4, shaken, but for the line x = 2.
"""

import random

import h5py
import make_parts_files as parts
import numpy as np

COUNT = 5
QUADS = [[i + COUNT * j, i + 1 + COUNT * j, i + 1 + COUNT * (j + 1), i + COUNT * (j + 1)]
         for j in range(COUNT - 1) for i in range(COUNT - 1)]  # from 0
LINE = [2 + COUNT * j for j in range(COUNT)]
EDGES = list(zip(LINE, LINE[1:]))


def points():
    shake = random.Random(5)
    inside = range(1, COUNT - 1)
    return np.array([[x + shake.uniform(-0.2, 0.2) * (x in inside and y in inside and x != 2),
                      y + shake.uniform(-0.2, 0.2) * (x in inside and y in inside), 0.0]
                     for y in range(COUNT) for x in range(COUNT)], dtype=float)


def from_one(lists):
    return [[node + 1 for node in each] for each in lists]


def make_exodus(name, element_type, side, space):
    file = parts.Exodus(name, points(), [(element_type, from_one(QUADS))],
                        (("num_side_sets", 1), ("len_string", 33)), space)
    file.side_set(1, [(2 + (COUNT - 1) * j, side) for j in range(COUNT - 1)])
    names = np.zeros((1, 33), dtype="S1")
    names[0, :5] = list("fault")
    file.data.createVariable("ss_names", "S1", ("num_side_sets", "len_string"))[:] = names
    file.data.close()


def make_cgns(name, vertices):
    path = "/Base/zone"
    tree = parts.root(3.4) + parts.zone("Base", "zone", points(), len(QUADS))
    tree += parts.section(path + "/quads", 7, 1, len(QUADS), from_one(QUADS))
    first = len(QUADS) + 1
    if not vertices:
        tree += parts.section(path + "/lines", 3, first, first + len(EDGES) - 1, from_one(EDGES))
    condition = path + "/ZoneBC/fault"
    members = [node + 1 for node in LINE] if vertices else list(range(first, first + len(EDGES)))
    tree += [(path + "/ZoneBC", "ZoneBC_t", None), (condition, "BC_t", "BCWall"),
             (condition + "/PointList", "IndexArray_t", np.array([members], dtype="i4")),
             (condition + "/GridLocation", "GridLocation_t",
              "Vertex" if vertices else "EdgeCenter")]
    parts.write_hdf5(name, tree)


def make_med():
    import meshio
    mesh = meshio.Mesh(points(), [("quad", QUADS), ("line", EDGES)],
                       cell_data={"cell_tags": [np.zeros(len(QUADS), int),
                                                np.full(len(EDGES), -2)]})
    mesh.cell_tags = {-2: ["fault"]}
    mesh.write(parts.HERE / "inner_line.med")
    with h5py.File(parts.HERE / "inner_line.med") as file:
        assert "FAS" in file


if __name__ == "__main__":
    make_exodus("inner_line.exo", "QUAD4", 2, 2)
    make_exodus("inner_line_shells.exo", "SHELL4", 4, 3)  # the edges come after the faces
    make_cgns("inner_line.cgns", vertices=False)
    make_cgns("inner_line_vertices.cgns", vertices=True)
    make_med()
