"""Makes the files beside it of meshes in parts and with cells that cannot be smoothed: zones and
polyhedra of CGNS in both containers, shells and polyhedra of Exodus, polyhedra of MED, time steps
of XDMF.

    apt-get install libcgns3.4; pip install medcoupling netCDF4 h5py; python3 make_parts_files.py

The ADF files are written by libcgns, the MED files by medcoupling. The others follow the documents:
CGNS' file mapping to HDF5, SAND92-2137, what dolfin's `write_checkpoint` writes.
"""

import ctypes
import pathlib

import h5py
import numpy as np

HERE = pathlib.Path(__file__).parent
LIBCGNS = "libcgns.so.3.4"


def box(nx, origin=0.0, step=1.0):
    """The nodes and hexahedra of a row of cubes, from 1, in the order of CGNS."""
    nodes = [(origin + step * i, j, k) for k in range(2) for j in range(2) for i in range(nx + 1)]

    def number(i, j, k):
        return 1 + i + (nx + 1) * (j + 2 * k)
    cells = [[number(i, 0, 0), number(i + 1, 0, 0), number(i + 1, 1, 0), number(i, 1, 0),
              number(i, 0, 1), number(i + 1, 0, 1), number(i + 1, 1, 1), number(i, 1, 1)]
             for i in range(nx)]
    return np.array(nodes, dtype=float), cells


# A tree of CGNS is a list of (path, label, data); text is a str.

def zone(base, name, points, cell_count):
    path = f"/{base}/{name}"
    tree = [(path, "Zone_t", np.array([[len(points)], [cell_count], [0]], dtype="i4")),
            (path + "/ZoneType", "ZoneType_t", "Unstructured"),
            (path + "/GridCoordinates", "GridCoordinates_t", None)]
    for axis, letter in enumerate("XYZ"):
        tree.append((f"{path}/GridCoordinates/Coordinate{letter}", "DataArray_t",
                     np.array(points[:, axis])))
    return tree


def section(path, kind, first, last, connectivity, offsets=None):
    tree = [(path, "Elements_t", np.array([kind, 0], dtype="i4")),
            (path + "/ElementRange", "IndexRange_t", np.array([first, last], dtype="i4")),
            (path + "/ElementConnectivity", "DataArray_t",
             np.array(connectivity, dtype="i4").flatten())]
    if offsets is not None:
        tree.append((path + "/ElementStartOffset", "DataArray_t", np.array(offsets, dtype="i4")))
    return tree


def root(version, base="Base"):
    return [("/CGNSLibraryVersion", "CGNSLibraryVersion_t", np.array([version], dtype="f4")),
            ("/" + base, "CGNSBase_t", np.array([3, 3], dtype="i4"))]


def zones_tree():
    """Two rows of three cubes that meet at x = 3, with a connectivity, conditions and a link."""
    tree = root(3.4)
    for name, origin, other, at in (("left", 0.0, "right", 3), ("right", 3.0, "left", 0)):
        points, cells = box(3, origin)
        points = points + 0.125 * np.sin(7 * points[:, [1, 2, 0]]) * (points[:, [0]] % 3 != 0)
        shared = [1 + at + 4 * row for row in range(4)]
        donors = [1 + (3 - at) + 4 * row for row in range(4)]
        tree += zone("Base", name, points, 3)
        path = "/Base/" + name
        tree += section(path + "/bricks", 17, 1, 3, cells)
        end = [shared[0], shared[1], shared[3], shared[2]]
        if name == "left":  # by its parent, the third cube, whose third facet it is
            tree += section(path + "/facets", 7, 4, 4, [0, 0, 0, 0])
            tree += [(path + "/facets/ParentElements", "DataArray_t",
                      np.array([[3], [0]], dtype="i4")),
                     (path + "/facets/ParentElementsPosition", "DataArray_t",
                      np.array([[3], [0]], dtype="i4"))]
        else:
            tree += section(path + "/facets", 20, 4, 4, [7] + end)
        tree += [(path + "/ZoneBC", "ZoneBC_t", None),
                 (path + "/ZoneBC/end", "BC_t", "BCWall"),
                 (path + "/ZoneBC/end/PointList", "IndexArray_t", np.array([[4]], dtype="i4")),
                 (path + "/ZoneBC/end/GridLocation", "GridLocation_t", "FaceCenter")]
        connectivity = path + "/ZoneGridConnectivity"
        node = f"{connectivity}/to_{other}"
        tree += [(connectivity, "ZoneGridConnectivity_t", None),
                 (node, "GridConnectivity_t", other),
                 (node + "/GridConnectivityType", "GridConnectivityType_t", "Abutting1to1"),
                 (node + "/PointList", "IndexArray_t", np.array([shared], dtype="i4")),
                 (node + "/PointListDonor", "IndexArray_t", np.array([donors], dtype="i4"))]
    return tree


def polyhedra_tree(version):
    """A row of three cubes by their faces, the last one with a face in two: no hexahedron."""
    points, cells = box(3)
    points = np.vstack([points, [[3, 0.5, 0.5]]])  # node 17, in the middle of the last face
    middle = len(points)
    faces, ids = [], {}

    def face(nodes):
        """Its number, negative where it is seen from the other side."""
        key = tuple(sorted(nodes))
        if key in ids:
            return -ids[key]
        faces.append(nodes)
        ids[key] = len(faces)
        return len(faces)
    polyhedra = []
    for place, c in enumerate(cells):
        sides = [[c[0], c[3], c[2], c[1]], [c[4], c[5], c[6], c[7]], [c[0], c[1], c[5], c[4]],
                 [c[3], c[7], c[6], c[2]], [c[0], c[4], c[7], c[3]], [c[1], c[2], c[6], c[5]]]
        if place == 2:
            last = sides.pop()
            sides += [[last[0], last[1], middle], [last[1], last[2], middle],
                      [last[2], last[3], middle], [last[3], last[0], middle]]
        polyhedra.append([face(side) for side in sides])
    tree = root(version) + zone("Base", "zone", points, 3)

    def add(name, kind, first, lists):
        if version < 4:
            numbers = [number for each in lists for number in [len(each), *each]]
            return section("/Base/zone/" + name, kind, first, first + len(lists) - 1, numbers)
        offsets = np.concatenate([[0], np.cumsum([len(each) for each in lists])])
        return section("/Base/zone/" + name, kind, first, first + len(lists) - 1,
                       [number for each in lists for number in each], offsets)
    tree += add("faces", 22, 1, faces) + add("cells", 23, len(faces) + 1, polyhedra)
    tree += [("/Base/zone/ZoneBC", "ZoneBC_t", None),
             ("/Base/zone/ZoneBC/tip", "BC_t", "BCWall"),
             ("/Base/zone/ZoneBC/tip/GridLocation", "GridLocation_t", "FaceCenter"),
             ("/Base/zone/ZoneBC/tip/PointRange", "IndexRange_t",
              np.array([[len(faces) - 3, len(faces)]], dtype="i4"))]
    return tree


TYPES = {"float32": b"R4", "float64": b"R8", "int32": b"I4", "int8": b"C1"}


def as_array(data):
    if isinstance(data, str):
        return np.frombuffer(data.encode(), dtype="i1")
    return data


def write_hdf5(name, tree):
    def describe(group, node, label, kind):
        group.attrs["name"] = np.bytes_(node).astype("S33")
        group.attrs["label"] = np.bytes_(label).astype("S33")
        group.attrs["type"] = np.bytes_(kind).astype("S3")
        group.attrs["flags"] = np.array([1], dtype="i4")
    with h5py.File(HERE / name, "w", libver="v108", track_order=True) as file:
        describe(file, "HDF5 MotherNode", "Root Node of HDF5 File", "MT")
        file[" format"] = as_array("IEEE_LITTLE_32".ljust(15, "\0"))
        file[" hdf5version"] = as_array("HDF5 Version 1.8.0".ljust(33, "\0"))
        for path, label, data in tree:
            group = file.create_group(path, track_order=True)
            kind = "MT" if data is None else TYPES[str(as_array(data).dtype)].decode()
            describe(group, path.rpartition("/")[2], label, kind)
            if data is not None:
                group[" data"] = as_array(data)


def write_adf(name, tree, layout):
    """`layout`: that of the numbers, "IEEE_LITTLE_32" or "IEEE_BIG_32", in the newer version of ADF,
    or "LEGACY", this machine's in the older one."""
    library = ctypes.CDLL(LIBCGNS)
    error = ctypes.c_int(0)

    def call(function, *arguments):
        getattr(library, function)(*arguments, ctypes.byref(error))
        assert error.value == -1, (function, error.value)
    top = ctypes.c_double()
    path = HERE / name
    path.unlink(missing_ok=True)
    call("ADF_Database_Open", str(path).encode(), b"NEW", layout.encode(), ctypes.byref(top))
    nodes = {"": top}
    for path, label, data in tree:
        parent, _, last = path.rpartition("/")
        node = nodes[path] = ctypes.c_double()
        call("ADF_Create", nodes[parent], last.encode(), ctypes.byref(node))
        call("ADF_Set_Label", node, label.encode())
        if data is None:
            continue
        array = np.ascontiguousarray(as_array(data))
        shape = array.shape[::-1]
        call("ADF_Put_Dimension_Information", node, TYPES[str(array.dtype)], len(shape),
             (ctypes.c_int * len(shape))(*shape))
        call("ADF_Write_All_Data", node, array.tobytes())
    call("ADF_Database_Close", top)


class Exodus:
    def __init__(self, name, points, blocks, dimensions=(), space=3):
        import netCDF4
        self.data = netCDF4.Dataset(HERE / name, "w", format="NETCDF3_64BIT_OFFSET")
        self.data.setncatts({"title": name, "api_version": np.float32(5.1),
                             "version": np.float32(5.1), "floating_point_word_size": np.int32(8),
                             "file_size": np.int32(1)})
        for dimension, size in (("num_dim", space), ("num_nodes", len(points)),
                                ("num_el_blk", len(blocks)), ("time_step", None),
                                *dimensions):
            self.data.createDimension(dimension, size)
        for axis, letter in enumerate("xyz"[:space]):
            self.put("coord" + letter, ("num_nodes",), [point[axis] for point in points], "f8")
        self.put("eb_prop1", ("num_el_blk",), [10 + block for block in range(len(blocks))])
        self.count = 0
        for number, (kind, cells) in enumerate(blocks, 1):
            self.add_block(number, kind, cells)
        self.data.createDimension("num_elem", self.count)

    def put(self, variable, dimensions, values, kind="i4"):
        self.data.createVariable(variable, kind, dimensions)[:] = values

    def lists(self, variable, counts, dimension, row, lists):
        """Lists of numbers of any length, by one array of them and one of their lengths."""
        self.data.createDimension(dimension, sum(map(len, lists)))
        self.put(variable, (dimension,), [number for each in lists for number in each])
        self.put(counts, (row,), list(map(len, lists)))

    def add_block(self, number, kind, cells):
        if cells is None:  # an empty one: no variable, no dimension
            return
        self.count += len(cells)
        row = f"num_el_in_blk{number}"
        self.data.createDimension(row, len(cells))
        variable = f"connect{number}"
        if kind == "nfaced":
            variable = f"facconn{number}"
            self.lists(variable, f"ebepecnt{number}", f"num_fac_per_el{number}", row, cells)
        elif kind == "nsided":
            self.lists(variable, f"ebepecnt{number}", f"num_nod_per_el{number}", row, cells)
        else:
            self.data.createDimension(f"num_nod_per_el{number}", len(cells[0]))
            self.put(variable, (row, f"num_nod_per_el{number}"), cells)
        self.data[variable].setncattr("elem_type", kind + "\0")

    def side_set(self, number, sides):
        dimension = f"num_side_ss{number}"
        self.data.createDimension(dimension, len(sides))
        self.put(f"elem_ss{number}", (dimension,), [side[0] for side in sides])
        self.put(f"side_ss{number}", (dimension,), [side[1] for side in sides])


def make_exodus_shells():
    """Quads and triangles in space, beams, a point, a superelement, an empty block."""
    points = [(i, j, 0.1 * i * j) for j in range(4) for i in range(4)]
    quads = [[1 + i + 4 * j, 2 + i + 4 * j, 6 + i + 4 * j, 5 + i + 4 * j]
             for j in range(3) for i in range(3)]
    last = quads.pop()
    triangles = [[last[0], last[1], last[2]], [last[0], last[2], last[3]]]
    file = Exodus("shells.exo", points,
                  [("Quad4", quads), ("TRI3", triangles), ("beam2", [[1, 2], [2, 3]]),
                   ("EMPTY", None), ("SPHERE", [[16]]), ("SUPER", [[6, 7, 10]])],
                  (("num_side_sets", 4),))
    file.put("eb_status", ("num_el_blk",), [1, 1, 1, 0, 1, 1])
    file.side_set(1, [(1, 6), (4, 6)])    # the edges 4-1 of two quads
    file.side_set(2, [(1, 2)])            # the back of a quad
    file.side_set(3, [(9, 3), (10, 5)])   # edges of the triangles
    file.side_set(4, [(11, 1), (13, 1)])  # the end of a beam, the point
    file.data.close()


def make_exodus_polyhedra():
    """A row of three cubes; the last one by its faces, with two hexagons by it for polygons."""
    points, cells = box(3)
    c = cells[2]
    faces = [[c[0], c[3], c[2], c[1]], [c[4], c[5], c[6], c[7]], [c[0], c[1], c[5], c[4]],
             [c[3], c[7], c[6], c[2]], [c[0], c[4], c[7], c[3]], [c[1], c[2], c[6]],
             [c[1], c[6], c[5]]]
    hexagon = [1, 2, 3, 7, 6, 5]
    file = Exodus("polyhedra.exo", points,
                  [("HEX8", cells[:2]), ("nfaced", [[1, 2, 3, 4, 5, 6, 7]]),
                   ("nsided", [hexagon, [1, 2, 6]])],
                  (("num_fa_blk", 1), ("num_side_sets", 1)))
    file.put("fa_prop1", ("num_fa_blk",), [1])
    file.data.createDimension("num_fa_in_blk1", len(faces))
    file.lists("fbconn1", "fbepecnt1", "num_nod_per_fa1", "num_fa_in_blk1", faces)
    file.data["fbconn1"].setncattr("elem_type", "nsided\0")
    file.side_set(1, [(3, 6), (4, 1)])  # a triangle of the polyhedron, an edge of the hexagon
    file.data.close()


def make_med():
    import medcoupling as mc
    points, cells = box(3)
    order = [0, 3, 2, 1, 4, 7, 6, 5]
    volume = mc.MEDCouplingUMesh("parts", 3)
    volume.setCoords(mc.DataArrayDouble(points.flatten().tolist(), len(points), 3))
    volume.allocateCells(3)
    for cell in cells[:2]:
        volume.insertNextCell(mc.NORM_HEXA8, [cell[place] - 1 for place in order])
    c = [node - 1 for node in cells[2]]
    faces = [[c[0], c[3], c[2], c[1]], [c[4], c[5], c[6], c[7]], [c[0], c[1], c[5], c[4]],
             [c[3], c[7], c[6], c[2]], [c[0], c[4], c[7], c[3]], [c[1], c[2], c[6]],
             [c[1], c[6], c[5]]]
    stream = []
    for face in faces:
        stream += ([-1] if stream else []) + face
    volume.insertNextCell(mc.NORM_POLYHED, stream)
    skin = mc.MEDCouplingUMesh("parts", 2)
    skin.setCoords(volume.getCoords())
    skin.allocateCells(2)
    skin.insertNextCell(mc.NORM_QUAD4, [0, 1, 5, 4])
    skin.insertNextCell(mc.NORM_POLYGON, [0, 1, 2, 6, 5, 4])
    file = mc.MEDFileUMesh()
    file[0] = volume
    file[-1] = skin
    group = mc.DataArrayInt([2])
    group.setName("odd")
    file.setGroupsAtLevel(0, [group])
    # A mesh of nodes alone beside it.
    cloud = mc.MEDFileUMesh()
    nodes = mc.DataArrayDouble([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], 2, 3)
    cloud.setCoords(nodes)
    cloud.setName("a cloud")
    meshes = mc.MEDFileMeshes()
    meshes.pushMesh(cloud)
    meshes.pushMesh(file)
    meshes.write(str(HERE / "polyhedra.med"), 2)


def make_checkpoint():
    """Two steps, each with a copy of the mesh of its own, by paths without a first slash."""
    points = np.array([[i, j] for j in range(3) for i in range(3)], dtype=float)
    points[4] = [1.2, 0.9]
    cells = [[i + 3 * j, i + 1 + 3 * j, i + 4 + 3 * j] for j in range(2) for i in range(2)]
    cells += [[i + 3 * j, i + 4 + 3 * j, i + 3 + 3 * j] for j in range(2) for i in range(2)]
    steps = []
    with h5py.File(HERE / "checkpoint.h5", "w", libver="latest") as file:
        for step in range(2):
            path = f"u/u_{step}/mesh"
            file[path + "/topology"] = np.array(cells)
            file[path + "/geometry"] = points
            file[f"u/u_{step}/vector"] = np.arange(len(points)) + float(step)
            steps.append(f"""      <Grid Name="mesh" GridType="Uniform">
        <Topology NumberOfElements="{len(cells)}" TopologyType="Triangle" NodesPerElement="3">
          <DataItem Dimensions="{len(cells)} 3" NumberType="UInt" Format="HDF">checkpoint.h5:u/u_{step}/mesh/topology</DataItem>
        </Topology>
        <Geometry GeometryType="XY">
          <DataItem Dimensions="{len(points)} 2" Format="HDF">checkpoint.h5:u/u_{step}/mesh/geometry</DataItem>
        </Geometry>
        <Time Value="{step}"/>
        <Attribute Name="u" AttributeType="Scalar" Center="Node">
          <DataItem Dimensions="{len(points)} 1" Format="HDF">checkpoint.h5:u/u_{step}/vector</DataItem>
        </Attribute>
      </Grid>
""")
    (HERE / "checkpoint.xdmf").write_text(
        '<?xml version="1.0"?>\n<Xdmf Version="3.0">\n  <Domain>\n'
        '    <Grid Name="u" GridType="Collection" CollectionType="Temporal">\n'
        + "".join(steps) + "    </Grid>\n  </Domain>\n</Xdmf>\n")


def make_corpus():
    """Small ones for tests/fuzz: scripts/fuzz takes no longer ones than 8192 bytes."""
    corpus = HERE.parents[1] / "fuzz" / "corpus"
    for name in ("shells", "polyhedra"):
        (corpus / "exodus_file" / name).write_bytes((HERE / f"{name}.exo").read_bytes())
    points, cells = box(1)
    tree = root(3.4) + zone("Base", "zone", points, 1)
    tree += section("/Base/zone/cells", 20, 1, 2, [17, *cells[0], 7, *cells[0][:4]])
    write_adf("corpus.cgns", tree, "IEEE_LITTLE_32")
    data = b"\1" + (HERE / "corpus.cgns").read_bytes()[:-1]  # the end of the free space
    (HERE / "corpus.cgns").unlink()
    assert len(data) <= 8192, len(data)
    (corpus / "hdf5_file" / "adf").write_bytes(data)
    grid = """<Grid Name="a"><Topology TopologyType="Mixed"><DataItem>4 0 1 2 16 1 3 0 1 2
3 5 0 1 2 3 0</DataItem></Topology><Geometry GeometryType="XY"><DataItem>0 0 1 0 0 1 1 1</DataItem>
</Geometry></Grid>"""
    again = """<Grid><xi:include xpointer="xpointer(//Grid[@Name='a']/*)"/></Grid>
<Grid><Topology Reference="//Topology[1]"/><Geometry Reference="XML">//Geometry[1]</Geometry></Grid>"""
    (corpus / "hdf5_file" / "grids").write_text(
        '\2<Xdmf xmlns:xi="http://www.w3.org/2001/XInclude"><Domain><Grid CollectionType="Temporal">'
        f'{grid}{again}</Grid><Grid GridType="Tree">{grid}{grid}</Grid></Domain></Xdmf>')


if __name__ == "__main__":
    write_hdf5("zones.cgns", zones_tree())
    write_adf("zones_adf.cgns", zones_tree(), "LEGACY")
    write_adf("polyhedra_adf.cgns", polyhedra_tree(3.4), "IEEE_BIG_32")
    write_hdf5("polyhedra.cgns", polyhedra_tree(4.2))
    make_exodus_shells()
    make_exodus_polyhedra()
    make_med()
    make_checkpoint()
    make_corpus()
