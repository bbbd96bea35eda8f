"""Makes the files second_order.* beside it: one element of every type of second order, apart from the
others, and an edge. The nodes in the middle of edges, faces and elements are the means of corners
as the formats' documents list them, so whoever reads their order wrongly finds other places.

    pip install medcoupling gmsh netCDF4 h5py vtk; python3 make_second_order_files.py

Gmsh's and medcoupling's files are what they write; VTK's readers check the others, which follow
SAND92-2137 (Exodus), the SIDS (CGNS) and Xdmf's numbers of types.
"""

import pathlib
import sys

import numpy as np

HERE = pathlib.Path(__file__).parent
SKEW = np.array([[1, 0.1, 0.2], [0.05, 1.1, 0.1], [0, -0.1, 1.2]])

# Corners in the order of Gmsh, Exodus and CGNS; all positive.
CORNERS = {
    "edge": [[0, 0, 0], [1, 0, 0]],
    "triangle": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
    "quad": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    "tetrahedron": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "pyramid": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.4, 0.5, 1]],
    "wedge": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]],
    "hexahedron": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0],
                   [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]}

# The parts in whose middle nodes lie, by corners counted from 1.
TRIANGLE = "12 23 31"
QUAD = "12 23 34 41"
PYRAMID = "12 23 34 41 15 25 35 45"
WEDGE = "12 23 31 14 25 36 45 56 64"           # Exodus and CGNS
HEXAHEDRON = "12 23 34 41 15 26 37 48 56 67 78 85"  # Exodus and CGNS
WEDGE_BY_LAYERS = "12 23 31 45 56 64 14 25 36"      # VTK, MED, Abaqus
HEXAHEDRON_BY_LAYERS = "12 23 34 41 56 67 78 85 15 26 37 48"
WEDGE_FACES = " 1254 2365 3146"
COMMON = [("edge", "12"), ("triangle", TRIANGLE), ("quad", QUAD), ("quad", QUAD + " 1234"),
          ("tetrahedron", "12 23 31 14 24 34"), ("pyramid", PYRAMID)]
EXODUS = COMMON + [("wedge", WEDGE), ("wedge", WEDGE + WEDGE_FACES), ("hexahedron", HEXAHEDRON),
                   ("hexahedron", HEXAHEDRON + " 12345678 1432 5678 1584 2376 1265 4378")]
CGNS = EXODUS[:-1] + [("hexahedron", HEXAHEDRON + " 1432 1265 2376 3487 1584 5678 12345678")]
VTK = COMMON + [("wedge", WEDGE_BY_LAYERS), ("wedge", WEDGE_BY_LAYERS + WEDGE_FACES),
                ("hexahedron", HEXAHEDRON_BY_LAYERS),
                ("hexahedron", HEXAHEDRON_BY_LAYERS + " 1584 2376 1265 4378 1432 5678 12345678")]


def turned(corners):
    """A wedge as VTK and MED see it."""
    return [corners[place] for place in (0, 2, 1, 3, 5, 4)] if len(corners) == 6 else corners


def elements(table, turn=False):
    """Of each row its shape and positions, moved away from the others."""
    result = []
    for number, (shape, parts) in enumerate(table):
        corners = np.array(turned(CORNERS[shape]) if turn else CORNERS[shape], dtype=float)
        points = corners @ SKEW + [4 * number, 0, 0]
        middles = [points[[int(corner) - 1 for corner in part]].mean(0) for part in parts.split()]
        result.append((shape, np.vstack([points, middles])))
    return result


def connectivity(rows):
    """The positions of all rows, and each row's nodes from 0."""
    first = np.cumsum([0] + [len(points) for _, points in rows])
    nodes = [np.arange(first[row], first[row + 1]) for row in range(len(rows))]
    return np.vstack([points for _, points in rows]), nodes


def check_by_vtk(reader, name):
    """Whether VTK's own reader gives nodes in the middle of their parts."""
    import vtk
    reader.SetFileName(str(HERE / name))
    reader.UpdateInformation()
    if hasattr(reader, "EnableAllBases"):
        reader.EnableAllBases()
    reader.Update()
    expected = {len(points): parts for (_, points), (_, parts) in zip(elements(VTK), VTK)}
    found = set()
    leaves = [reader.GetOutputDataObject(0)]
    while leaves:
        data = leaves.pop()
        if data is not None and data.IsA("vtkMultiBlockDataSet"):
            leaves += [data.GetBlock(block) for block in range(data.GetNumberOfBlocks())]
        if data is None or not data.IsA("vtkUnstructuredGrid"):
            continue
        for cell in range(data.GetNumberOfCells()):
            ids = data.GetCell(cell).GetPointIds()
            points = np.array([data.GetPoint(ids.GetId(node))
                               for node in range(ids.GetNumberOfIds())])
            parts = expected[len(points)].split()
            for place, part in enumerate(parts, len(points) - len(parts)):
                middle = points[[int(corner) - 1 for corner in part]].mean(0)
                assert np.allclose(points[place], middle, atol=1e-6), (name, len(points), place)
            found.add(data.GetCellType(cell))
    print(name, "by VTK", vtk.VTK_VERSION, sorted(found))


def make_gmsh():
    import gmsh
    for name, version in (("second_order.msh", 4.1), ("second_order_v2.msh", 2.2)):
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        first = 1
        members = {1: [], 2: [], 3: []}
        for element, kind in enumerate((8, 9, 16, 10, 11, 19, 18, 13, 17, 12), 1):
            _, dimension, _, count, local, _ = gmsh.model.mesh.getElementProperties(kind)
            gmsh.model.addDiscreteEntity(dimension, element)
            members[dimension].append(element)
            points = np.zeros((count, 3))
            points[:, :dimension] = np.array(local).reshape(count, dimension)
            points = points @ SKEW + [4 * element, 0, 0]
            tags = list(range(first, first + count))
            first += count
            gmsh.model.mesh.addNodes(dimension, element, tags, points.flatten())
            gmsh.model.mesh.addElementsByType(element, kind, [element], tags)
        for dimension, group in ((1, "edges"), (2, "skin"), (3, "body")):
            gmsh.model.addPhysicalGroup(dimension, members[dimension], 1, group)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.write(str(HERE / name))
        gmsh.finalize()


def make_med():
    """By medcoupling, which adds the nodes; its conversion makes no PENTA18, whose faces it knows."""
    import medcoupling as mc
    order = {"tetrahedron": (0, 2, 1, 3), "pyramid": (0, 3, 2, 1, 4), "wedge": (0, 2, 1, 3, 5, 4),
             "hexahedron": (0, 3, 2, 1, 4, 7, 6, 5)}
    linear = {"edge": "SEG2", "triangle": "TRI3", "quad": "QUAD4", "tetrahedron": "TETRA4",
              "pyramid": "PYRA5", "wedge": "PENTA6", "hexahedron": "HEXA8"}
    kinds = [("edge", 0, "SEG3", 1), ("triangle", 0, "TRI6", 2), ("quad", 0, "QUAD8", 2),
             ("quad", 1, "QUAD9", 2), ("tetrahedron", 0, "TETRA10", 3), ("pyramid", 0, "PYRA13", 3),
             ("wedge", 0, "PENTA15", 3), ("wedge", 0, "PENTA18", 3), ("hexahedron", 0, "HEXA20", 3),
             ("hexahedron", 1, "HEXA27", 3)]
    positions, cells = [], []
    for number, (shape, conversion, kind, dimension) in enumerate(kinds):
        corners = np.array(CORNERS[shape], dtype=float)[list(order.get(shape, range(4)))[:len(
            CORNERS[shape])]] @ SKEW + [4 * number, 0, 0]
        one = mc.MEDCouplingUMesh("one", dimension)
        one.setCoords(mc.DataArrayDouble(corners.flatten().tolist(), len(corners), 3))
        one.allocateCells(1)
        one.insertNextCell(getattr(mc, "NORM_" + linear[shape]), list(range(len(corners))))
        one.convertLinearCellsToQuadratic(conversion)
        points = np.array(one.getCoords().getValues()).reshape(-1, 3)[one.getNodeIdsOfCell(0)]
        if kind == "PENTA18":
            wedge = mc.MEDCouplingUMesh("wedge", 3)
            wedge.setCoords(mc.DataArrayDouble([0.0] * 54, 18, 3))
            wedge.allocateCells(1)
            wedge.insertNextCell(mc.NORM_PENTA18, list(range(18)))
            faces = wedge.buildDescendingConnectivity()[0]
            middles = {}
            for face in range(faces.getNumberOfCells()):
                nodes = faces.getNodeIdsOfCell(face)
                if len(nodes) == 9:
                    middles[nodes[8]] = points[nodes[:4]].mean(0)
            points = np.vstack([points, [middles[node] for node in (15, 16, 17)]])
        first = sum(map(len, positions))
        positions.append(points)
        cells.append((kind, dimension, list(range(first, first + len(points)))))
    count = sum(map(len, positions))
    coordinates = mc.DataArrayDouble(np.vstack(positions).flatten().tolist(), count, 3)
    file = mc.MEDFileUMesh()
    for level in (0, -1, -2):
        mesh = mc.MEDCouplingUMesh("second_order", 3 + level)
        mesh.setCoords(coordinates)
        mesh.allocateCells(1)
        for kind, dimension, nodes in cells:
            if dimension == 3 + level:
                mesh.insertNextCell(getattr(mc, "NORM_" + kind), nodes)
        file[level] = mesh
    skin = mc.DataArrayInt([0, 1, 2])
    skin.setName("skin")
    file.setGroupsAtLevel(-1, [skin])
    file.write(str(HERE / "second_order.med"), 2)


def make_cgns():
    import h5py
    types = {3: 4, 6: 6, 8: 8, 9: 9, 10: 11, 13: 21, 15: 15, 18: 16, 20: 18, 27: 19}
    positions, nodes = connectivity(elements(CGNS))
    with h5py.File(HERE / "second_order.cgns", "w", libver="latest") as file:
        def node(path, label, data=None, kind=b"MT"):
            group = file.require_group(path)
            group.attrs["name"] = np.bytes_(path.rsplit("/", 1)[-1].ljust(32, "\0")[:32])
            group.attrs["label"] = np.bytes_(label)
            group.attrs["type"] = np.bytes_(kind)
            group.attrs["flags"] = np.array([1], dtype="i4")
            if isinstance(data, str):
                data = np.frombuffer(data.encode(), dtype="i1")
            if data is not None:
                group[" data"] = data
        file.attrs["name"] = np.bytes_("HDF5 MotherNode")
        file.attrs["label"] = np.bytes_("Root Node of HDF5 File")
        file.attrs["type"] = np.bytes_("MT")
        file[" format"] = np.frombuffer(b"IEEE_LITTLE_32\0", dtype="i1")
        file[" hdf5version"] = np.frombuffer(b"HDF5 Version 1.8.17".ljust(33, b"\0"), dtype="i1")
        node("CGNSLibraryVersion", "CGNSLibraryVersion_t", np.array([3.4], dtype="f4"), b"R4")
        node("Base", "CGNSBase_t", np.array([3, 3], dtype="i4"), b"I4")
        size = np.array([[len(positions)], [6], [0]], dtype="i4")
        node("Base/Zone", "Zone_t", size, b"I4")
        node("Base/Zone/ZoneType", "ZoneType_t", "Unstructured", b"C1")
        node("Base/Zone/GridCoordinates", "GridCoordinates_t")
        for axis, letter in enumerate("XYZ"):
            node("Base/Zone/GridCoordinates/Coordinate" + letter, "DataArray_t",
                 positions[:, axis].copy(), b"R8")
        # Volumes first, as readers expect it; the edge and the surfaces after them.
        order = list(range(4, 10)) + [1, 2, 3, 0]
        for number, row in enumerate(order, 1):
            path = f"Base/Zone/E{number:02}"
            node(path, "Elements_t", np.array([types[len(nodes[row])], 0], dtype="i4"), b"I4")
            node(path + "/ElementRange", "IndexRange_t", np.array([number] * 2, dtype="i4"), b"I4")
            node(path + "/ElementConnectivity", "DataArray_t", (nodes[row] + 1).astype("i4"), b"I4")
        node("Base/Zone/ZoneBC", "ZoneBC_t")
        node("Base/Zone/ZoneBC/skin", "BC_t", "BCWall", b"C1")
        node("Base/Zone/ZoneBC/skin/PointRange", "IndexRange_t", np.array([[7, 9]], dtype="i4").T,
             b"I4")
        node("Base/Zone/ZoneBC/skin/GridLocation", "GridLocation_t", "FaceCenter", b"C1")


def make_exodus():
    import netCDF4
    positions, nodes = connectivity(elements(EXODUS))
    data = netCDF4.Dataset(HERE / "second_order.exo", "w", format="NETCDF3_64BIT_OFFSET")
    data.setncatts({"title": "second order", "api_version": np.float32(5.1),
                    "version": np.float32(5.1), "floating_point_word_size": np.int32(8),
                    "file_size": np.int32(1)})
    names = ["BAR3", "TRI6", "SHELL8", "SHELL9", "TETRA10", "PYRAMID13", "WEDGE15", "WEDGE18",
             "HEX20", "HEX27"]
    for dimension, size in (("len_string", 33), ("time_step", None), ("num_dim", 3), ("num_nodes", len(positions)),
                            ("num_elem", 10), ("num_el_blk", 10), ("num_side_sets", 1),
                            ("num_side_ss1", 6)):
        data.createDimension(dimension, size)

    def put(variable, kind, dimensions, values):
        data.createVariable(variable, kind, dimensions)[:] = values
    for axis, letter in enumerate("xyz"):
        put("coord" + letter, "f8", ("num_nodes",), positions[:, axis])
    put("eb_status", "i4", ("num_el_blk",), [1] * 10)
    put("eb_prop1", "i4", ("num_el_blk",), range(1, 11))
    data["eb_prop1"].setncattr("name", "ID")
    for number, (kind, cell) in enumerate(zip(names, nodes), 1):
        data.createDimension(f"num_el_in_blk{number}", 1)
        data.createDimension(f"num_nod_per_el{number}", len(cell))
        put(f"connect{number}", "i4", (f"num_el_in_blk{number}", f"num_nod_per_el{number}"),
            [cell + 1])
        data[f"connect{number}"].setncattr("elem_type", kind)
    # The first side of each volume.
    put("ss_status", "i4", ("num_side_sets",), [1])
    put("ss_prop1", "i4", ("num_side_sets",), [1])
    put("elem_ss1", "i4", ("num_side_ss1",), range(5, 11))
    put("side_ss1", "i4", ("num_side_ss1",), [1] * 6)
    data.close()


def make_xdmf():
    positions, nodes = connectivity(elements(VTK, turn=True))
    numbers = [0x22, 0x24, 0x25, 0x23, 0x26, 0x27, 0x28, 0x29, 0x30, 0x32]
    cells = [f"{number} " + " ".join(map(str, cell)) for number, cell in zip(numbers, nodes)]
    rows = "\n".join(" ".join(map(repr, row)) for row in positions.tolist())
    size = sum(map(len, nodes)) + len(nodes)
    (HERE / "second_order.xdmf").write_text(f"""<?xml version="1.0"?>
<Xdmf Version="3.0"><Domain><Grid Name="second order" GridType="Uniform">
<Topology TopologyType="Mixed" NumberOfElements="{len(nodes)}">
<DataItem DataType="Int" Dimensions="{size}" Format="XML">
{chr(10).join(cells)}
</DataItem></Topology>
<Geometry GeometryType="XYZ">
<DataItem DataType="Float" Precision="8" Dimensions="{len(positions)} 3" Format="XML">
{rows}
</DataItem></Geometry>
</Grid></Domain></Xdmf>
""")


def check():
    import vtk
    check_by_vtk(vtk.vtkExodusIIReader(), "second_order.exo")
    check_by_vtk(vtk.vtkCGNSReader(), "second_order.cgns")
    check_by_vtk(vtk.vtkXdmfReader(), "second_order.xdmf")


if sys.argv[1:] != ["check"]:
    for make in (make_gmsh, make_med, make_cgns, make_exodus, make_xdmf):
        make()
check()
