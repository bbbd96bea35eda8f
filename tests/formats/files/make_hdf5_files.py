"""Makes the MED, CGNS, Exodus and XDMF files beside it: a cube with a pyramid on it, a wedge at its
side and a tetrahedron on the pyramid, with facets of two groups, by the libraries of others.

    pip install medcoupling gmsh netCDF4 meshio h5py; python3 make_hdf5_files.py
    apt-get install python3-dolfinx; /usr/bin/python3 make_hdf5_files.py dolfinx

One file per program; gmsh's, meshio's and dolfinx's are what they write, the Exodus files follow
SAND92-2137.
"""

import pathlib
import sys

HERE = pathlib.Path(__file__).parent
POINTS = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1],
          [0.5, 0.5, 2], [2, 0, 0.5], [2, 1, 0.5], [2, 0.5, 1.5]]
# In VTK's order, whose wedge has its first triangle looking outward.
HEXAHEDRON = [0, 1, 2, 3, 4, 5, 6, 7]
PYRAMID = [4, 5, 6, 7, 8]
WEDGE = [1, 9, 5, 2, 10, 6]
TETRAHEDRON = [5, 6, 8, 11]
WALL = [0, 3, 2, 1]  # a quad
TIP = [6, 8, 11]     # a triangle
CORNERS = [0, 8]     # nodes


def turned(wedge):
    """To the order of Gmsh, CGNS and Exodus, and back."""
    return [wedge[place] for place in (0, 2, 1, 3, 5, 4)]


def make_med():
    import medcoupling as mc
    points = mc.DataArrayDouble(sum(map(list, POINTS), []), len(POINTS), 3)
    volume = mc.MEDCouplingUMesh("assembly", 3)
    volume.setCoords(points)
    volume.allocateCells(4)
    h, p, t = HEXAHEDRON, PYRAMID, TETRAHEDRON
    volume.insertNextCell(mc.NORM_TETRA4, [t[0], t[2], t[1], t[3]])
    volume.insertNextCell(mc.NORM_PYRA5, [p[0], p[3], p[2], p[1], p[4]])
    volume.insertNextCell(mc.NORM_PENTA6, WEDGE)
    volume.insertNextCell(mc.NORM_HEXA8, [h[0], h[3], h[2], h[1], h[4], h[7], h[6], h[5]])
    assert all(value > 0 for value in volume.getMeasureField(False).getArray().getValues())
    facets = mc.MEDCouplingUMesh("assembly", 2)
    facets.setCoords(points)
    facets.allocateCells(2)
    facets.insertNextCell(mc.NORM_TRI3, TIP)
    facets.insertNextCell(mc.NORM_QUAD4, WALL)
    file = mc.MEDFileUMesh()
    file[0] = volume
    file[-1] = facets

    def group(level, name, ids):
        array = mc.DataArrayInt(ids)
        array.setName(name)
        return level, array
    by_level = {0: [("air", [0, 1]), ("rock", [2, 3])], -1: [("tip", [0]), ("wall", [1])],
                1: [("corners", CORNERS)]}
    for level, groups in by_level.items():
        file.setGroupsAtLevel(level, [group(level, *each)[1] for each in groups])
    field = mc.MEDCouplingFieldDouble(mc.ON_NODES, mc.ONE_TIME)
    field.setName("temperature")
    field.setMesh(volume)
    field.setArray(mc.DataArrayDouble([float(node) for node in range(len(POINTS))]))
    field.setTime(0, 0, 0)
    file.write(str(HERE / "assembly.med"), 2)
    mc.WriteFieldUsingAlreadyWrittenMesh(str(HERE / "assembly.med"), field)


def make_cgns():
    import gmsh
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("assembly")
    for dimension, count in ((2, 2), (3, 2)):
        for tag in range(1, count + 1):
            gmsh.model.addDiscreteEntity(dimension, tag)
    gmsh.model.mesh.addNodes(3, 1, list(range(1, len(POINTS) + 1)), sum(map(list, POINTS), []))

    def add(dimension, tag, kind, element, nodes):
        gmsh.model.mesh.addElements(dimension, tag, [kind], [[element]],
                                    [[node + 1 for node in nodes]])
    add(2, 1, 3, 1, WALL)
    add(2, 2, 2, 2, TIP)
    add(3, 1, 5, 3, HEXAHEDRON)
    add(3, 1, 6, 4, turned(WEDGE))
    add(3, 2, 7, 5, PYRAMID)
    add(3, 2, 4, 6, TETRAHEDRON)
    for dimension, tag, name in ((2, 1, "wall"), (2, 2, "tip"), (3, 1, "rock"), (3, 2, "air")):
        gmsh.model.addPhysicalGroup(dimension, [tag], tag, name)
    gmsh.write(str(HERE / "assembly.cgns"))
    gmsh.finalize()


def make_exodus(name, file_format, real):
    import netCDF4
    import numpy as np
    data = netCDF4.Dataset(HERE / name, "w", format=file_format)
    data.setncatts({"title": "assembly", "api_version": np.float32(5.1),
                    "version": np.float32(5.1), "floating_point_word_size": np.int32(8),
                    "file_size": np.int32(1)})  # coordx, coordy … instead of coord
    options = {"zlib": True, "chunksizes": (5,)} if file_format == "NETCDF4" else {}
    blocks = [(10, "rock", "HEX8", [HEXAHEDRON]), (11, "ramp", "WEDGE", [turned(WEDGE)]),
              (20, "air", "PYRAMID5", [PYRAMID]), (21, "", "TETRA", [TETRAHEDRON])]
    for dimension, size in (("len_string", 33), ("len_name", 33), ("num_dim", 3),
                            ("num_nodes", len(POINTS)), ("num_elem", 4), ("num_el_blk", 4),
                            ("num_node_sets", 2), ("num_side_sets", 2), ("time_step", None),
                            ("num_nod_ns1", 2), ("num_nod_ns2", 1), ("num_side_ss1", 1),
                            ("num_side_ss2", 2), ("num_nod_var", 1)):
        data.createDimension(dimension, size)

    def put(variable, kind, dimensions, values, **more):
        data.createVariable(variable, kind, dimensions, **more)[:] = values

    def names(variable, dimension, texts):
        put(variable, "S1", (dimension, "len_name"),
            netCDF4.stringtochar(np.array(texts, dtype="S33")))
    for axis, letter in enumerate("xyz"):
        put("coord" + letter, real, ("num_nodes",), [point[axis] for point in POINTS], **options)
    put("eb_status", "i4", ("num_el_blk",), [1] * 4)
    put("eb_prop1", "i4", ("num_el_blk",), [block[0] for block in blocks])
    data["eb_prop1"].setncattr("name", "ID")
    names("eb_names", "num_el_blk", [block[1] for block in blocks])
    for number, (_, _, kind, cells) in enumerate(blocks, 1):
        data.createDimension(f"num_el_in_blk{number}", len(cells))
        data.createDimension(f"num_nod_per_el{number}", len(cells[0]))
        put(f"connect{number}", "i4", (f"num_el_in_blk{number}", f"num_nod_per_el{number}"),
            np.array(cells) + 1)
        data[f"connect{number}"].setncattr("elem_type", kind)
    put("node_num_map", "i4", ("num_nodes",), [100 + node for node in range(len(POINTS))])
    put("elem_num_map", "i4", ("num_elem",), [7, 8, 9, 10])
    put("ns_prop1", "i4", ("num_node_sets",), [1, 5])
    names("ns_names", "num_node_sets", ["corners", ""])
    put("node_ns1", "i4", ("num_nod_ns1",), np.array(CORNERS) + 1)
    put("node_ns2", "i4", ("num_nod_ns2",), [4])
    put("ss_prop1", "i4", ("num_side_sets",), [3, 4])
    names("ss_names", "num_side_sets", ["wall", "skin"])
    put("elem_ss1", "i4", ("num_side_ss1",), [1])  # the cube's bottom
    put("side_ss1", "i4", ("num_side_ss1",), [5])
    put("elem_ss2", "i4", ("num_side_ss2",), [4, 2])  # the tetrahedron's 2-3-4, the wedge's 1-2-3
    put("side_ss2", "i4", ("num_side_ss2",), [2, 4])
    put("time_whole", "f8", ("time_step",), [0.0, 1.0])
    names("name_nod_var", "num_nod_var", ["temperature"])
    put("vals_nod_var1", "f8", ("time_step", "num_nodes"),
        [[step + node for node in range(len(POINTS))] for step in range(2)])
    data.close()


def make_meshio():
    import meshio
    import numpy as np
    cells = [("hexahedron", [HEXAHEDRON]), ("pyramid", [PYRAMID]), ("wedge", [WEDGE]),
             ("tetra", [TETRAHEDRON]), ("quad", [WALL])]
    tags = [[1], [2], [1], [2], [9]]
    mesh = meshio.Mesh(np.array(POINTS, dtype=np.float32), cells,
                       point_data={"temperature": np.arange(len(POINTS), dtype=float)},
                       cell_data={"gmsh:physical": [np.array(tag) for tag in tags]})
    meshio.write(HERE / "mixed_meshio.xdmf", mesh)
    flat = meshio.Mesh(np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.4, 0.6]]),
                       [("triangle", [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])])
    meshio.write(HERE / "flat_inline.xdmf", flat, data_format="XML")


def make_dolfinx():
    import numpy as np
    from dolfinx import io, mesh
    from mpi4py import MPI
    cube = mesh.create_unit_cube(MPI.COMM_SELF, 1, 1, 1)
    facets = mesh.locate_entities_boundary(cube, 2, lambda x: np.isclose(x[0], 0))
    walls = mesh.meshtags(cube, 2, np.sort(facets), np.full(len(facets), 3, dtype=np.int32))
    walls.name = "walls"
    count = cube.topology.index_map(3).size_local
    above = mesh.compute_midpoints(cube, 3, np.arange(count, dtype=np.int32))[:, 0] > 0.5
    parts = mesh.meshtags(cube, 3, np.arange(count, dtype=np.int32), above.astype(np.int32) + 1)
    parts.name = "parts"
    cube.topology.create_connectivity(2, 3)
    with io.XDMFFile(cube.comm, str(HERE / "dolfinx.xdmf"), "w") as file:
        file.write_mesh(cube)
        file.write_meshtags(walls)
        file.write_meshtags(parts)


def make_corpus():
    """One tetrahedron and a triangle of it, in as few bytes as HDF5 can."""
    import h5py
    import numpy as np
    corpus = HERE.parents[1] / "fuzz" / "corpus"
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])

    def store(target, name, head, write):
        path = HERE / "corpus.h5"
        with h5py.File(path, "w", libver="latest") as file:
            write(file)
        data = head + path.read_bytes()
        path.unlink()
        assert len(data) <= 8192, len(data)  # scripts/fuzz takes no longer ones
        (corpus / target).mkdir(parents=True, exist_ok=True)
        (corpus / target / name).write_bytes(data)

    def med(file):
        step = file.create_group("ENS_MAA/m/s")
        step["NOE/COO"] = points.flatten(order="F")
        step["NOE/COO"].attrs["NBR"] = 4
        step["NOE/FAM"] = [1, 0, 0, 0]
        step["MAI/TE4/NOD"] = [1, 3, 2, 4]
        step["MAI/TE4/FAM"] = [-1]
        step["MAI/TR3/NOD"] = [1, 2, 3]
        for folder, number in (("ELEME/a", -1), ("NOEUD/b", 1)):
            family = file.create_group("FAS/m/" + folder)
            family.attrs["NUM"] = number
            family["GRO/NOM"] = np.frombuffer(b"name".ljust(80, b"\0"), dtype="i1").reshape(1, 80)

    def cgns(file):
        def node(path, label, data=None):
            group = file.require_group(path)
            group.attrs["label"] = np.bytes_(label)
            if isinstance(data, str):
                data = np.frombuffer(data.encode(), dtype="i1")
            if data is not None:
                group[" data"] = data
        node("B", "CGNSBase_t")
        node("B/Z", "Zone_t", [[4], [1], [0]])
        node("B/Z/ZoneType", "ZoneType_t", "Unstructured")
        for axis, letter in enumerate("XYZ"):
            node("B/Z/GridCoordinates/Coordinate" + letter, "DataArray_t", points[:, axis])
        node("B/Z/E", "Elements_t", [20, 0])
        node("B/Z/E/ElementRange", "IndexRange_t", [1, 2])
        node("B/Z/E/ElementConnectivity", "DataArray_t", [10, 1, 2, 3, 4, 5, 1, 2, 3])
        node("B/Z/ZoneBC", "ZoneBC_t")
        node("B/Z/ZoneBC/C", "BC_t")
        node("B/Z/ZoneBC/C/PointList", "IndexArray_t", [[2]])
        node("B/Z/ZoneBC/C/GridLocation", "GridLocation_t", "FaceCenter")

    def xdmf(file):
        file["x"] = points.astype("f4")
        file["c"] = [6, 0, 1, 2, 3, 4, 0, 1, 2]
        file["v"] = [1, 2]
    text = b"""<Xdmf><Domain><Grid Name="g"><Geometry GeometryType="XYZ">
<DataItem Format="HDF">given.h5:/x</DataItem></Geometry><Topology TopologyType="Mixed">
<DataItem Format="HDF">given.h5:/c</DataItem></Topology><Attribute Name="a" Center="Cell">
<DataItem Format="HDF">given.h5:/v</DataItem></Attribute></Grid><Grid Name="t">
<Topology TopologyType="Triangle"><DataItem DataType="Int">0 1 2</DataItem></Topology>
<Attribute Name="b" Center="Cell"><DataItem DataType="Int">7</DataItem></Attribute></Grid>
</Domain></Xdmf>"""
    store("hdf5_file", "med", b"\0", med)
    store("hdf5_file", "cgns", b"\1", cgns)
    store("hdf5_file", "xdmf", b"\2" + text + b"\n---\n", xdmf)
    (corpus / "hdf5_file" / "inline").write_bytes(
        b"\2" + (HERE / "flat_inline.xdmf").read_bytes())
    (corpus / "exodus_file").mkdir(exist_ok=True)
    (corpus / "exodus_file" / "offset").write_bytes((HERE / "assembly.exo").read_bytes())


if sys.argv[1:] == ["dolfinx"]:
    make_dolfinx()
else:
    make_med()
    make_cgns()
    make_exodus("assembly.exo", "NETCDF3_64BIT_OFFSET", "f8")
    make_exodus("compressed.e", "NETCDF4", "f4")
    make_meshio()
    make_corpus()
