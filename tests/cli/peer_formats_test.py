"""Files of MED, Exodus, CGNS and XDMF that the program wrote, read by the libraries of the formats'
own users: medcoupling, netCDF4, VTK, Gmsh, meshio, dolfinx. Each runs in the first interpreter that has
it: $MESHSMOOTH_PEERS_PYTHON, /usr/bin/python3, this one."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import textwrap
import unittest
from pathlib import Path

from test_main import main, needs_peers

CLI = os.environ["MESHSMOOTH_CLI"]
FILES = Path(__file__).parents[1] / "formats" / "files"
INTERPRETERS = [os.environ.get("MESHSMOOTH_PEERS_PYTHON"), "/usr/bin/python3", sys.executable]


# Debian's Gmsh reads no CGNS, PyPI's does.
NEEDS = {"gmsh": 'gmsh.initialize(); assert "Cgns" in gmsh.option.getString("General.BuildOptions")'}


def interpreter_with(module):
    code = f"import {module}; {NEEDS.get(module, '')}"
    for interpreter in filter(None, INTERPRETERS):
        if shutil.which(interpreter) and subprocess.run(
                [interpreter, "-c", code], capture_output=True).returncode == 0:
            return interpreter
    needs = f" with {NEEDS[module]}" if module in NEEDS else ""
    raise unittest.SkipTest(f"no interpreter has {module} (MESHSMOOTH_PEERS_PYTHON names one){needs}")


def ask(module, script, *files):
    """What the script prints as JSON on its last line; it has the files in `files`."""
    code = "import sys, json\nfiles = sys.argv[1:]\n" + textwrap.dedent(script)
    done = subprocess.run([interpreter_with(module), "-c", code, *map(str, files)],
                          capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


@needs_peers
class PeerFormats(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def moved(self, name, *flags):
        """The file and the path of the same mesh with nodes that smoothing moved."""
        given, result = FILES / name, self.folder / ("out" + Path(name).suffix)
        subprocess.run([CLI, "smooth", given, "-o", result, "--method", "laplacian", "--iterations",
                        "3", "--guard", "off", "--boundary", "free", "--quiet", *flags], check=True)
        return given, result

    def check(self, answers, node_count):
        """Two answers: points, and all else, which must be the same."""
        (points, *rest), (moved_points, *moved_rest) = answers
        self.assertEqual(len(points), node_count)
        self.assertEqual(len(moved_points), node_count)
        self.assertNotEqual(points, moved_points)
        self.assertEqual(rest, moved_rest)
        return points, moved_points

    def test_medcoupling_reads_med(self):
        script = """
            import medcoupling as mc
            def read(file):
                mesh = mc.MEDFileMesh.New(file)
                groups = {name: mesh.getGroupsOnSpecifiedLev(level) and
                          mesh.getGroupArr(level, name).getValues()
                          for level in (0, -1, 1) for name in mesh.getGroupsOnSpecifiedLev(level)}
                levels = [mesh[level].getNodalConnectivity().getValues() for level in (0, -1)]
                fields = mc.GetAllFieldNames(file)
                values = mc.MEDFileField1TS(file, fields[0]).getUndergroundDataArray().getValues()
                volumes = mesh[0].getMeasureField(False).getArray().getValues()
                return [mesh.getCoords().getValuesAsTuple(), groups, levels, list(fields), values]
            print(json.dumps([read(file) for file in files]))
            """
        answers = ask("medcoupling", script, *self.moved("assembly.med", "--fixed-set", "wall"))
        points, moved = self.check(answers, 12)
        self.assertEqual(points[:4], moved[:4])  # of the group

    def test_netcdf_reads_exodus(self):
        script = """
            import netCDF4
            def read(file):
                data = netCDF4.Dataset(file)
                data.set_auto_mask(False)
                points = list(zip(*(data[f"coord{axis}"][:].tolist() for axis in "xyz")))
                rest = {name: [variable[:].tolist() if variable.dtype.kind in "iuf" else
                               variable[:].tobytes().hex(), str(variable.dtype),
                               variable.filters(), variable.ncattrs()]
                        for name, variable in data.variables.items() if "coord" not in name}
                return [points, rest, data.ncattrs(), data.data_model]
            print(json.dumps([read(file) for file in files]))
            """
        for name in ("assembly.exo", "compressed.e"):
            with self.subTest(name):
                answers = ask("netCDF4", script, *self.moved(name, "--fixed-set", "corners"))
                points, moved = self.check(answers, 12)
                self.assertEqual((points[0], points[8]), (moved[0], moved[8]))

    def test_vtk_reads_exodus(self):
        script = """
            from vtkmodules.vtkIOExodus import vtkExodusIIReader
            def read(file):
                reader = vtkExodusIIReader()
                reader.SetFileName(file)
                reader.GenerateGlobalNodeIdArrayOn()
                reader.UpdateInformation()
                for kind in (reader.NODE_SET, reader.SIDE_SET):
                    for index in range(reader.GetNumberOfObjects(kind)):
                        reader.SetObjectStatus(kind, index, 1)
                reader.Update()
                names, cells, points = [], [], {}
                for kind in range(reader.GetOutput().GetNumberOfBlocks()):
                    blocks = reader.GetOutput().GetBlock(kind)
                    for index in range(blocks.GetNumberOfBlocks() if blocks else 0):
                        names.append(blocks.GetMetaData(index).Get(blocks.NAME()))
                        grid = blocks.GetBlock(index)
                        ids = grid.GetPointData().GetArray("GlobalNodeId")
                        for cell in range(grid.GetNumberOfCells()):
                            of = grid.GetCell(cell)
                            cells.append([of.GetCellType()] + [
                                int(ids.GetTuple1(of.GetPointId(place)))
                                for place in range(of.GetNumberOfPoints())])
                        for point in range(grid.GetNumberOfPoints()):
                            points[int(ids.GetTuple1(point))] = grid.GetPoint(point)
                return [sorted(points.items()), names, cells]
            print(json.dumps([read(file) for file in files]))
            """
        self.check(ask("vtkmodules.vtkIOExodus", script, *self.moved("assembly.exo")), 12)

    def test_gmsh_reads_cgns(self):
        script = """
            import gmsh
            gmsh.initialize()
            gmsh.option.setNumber("General.Terminal", 0)
            def read(file):
                gmsh.clear()
                gmsh.open(file)
                tags, places, _ = gmsh.model.mesh.getNodes()
                points = sorted(zip(tags.tolist(), *places.reshape(-1, 3).T.tolist()))
                elements = [[dimension, [each.tolist() for each in
                                         gmsh.model.mesh.getElements(dimension, tag)[2]]]
                            for dimension, tag in gmsh.model.getEntities()]
                groups = [gmsh.model.getPhysicalName(*group)
                          for group in gmsh.model.getPhysicalGroups()]
                return [points, elements, groups]
            print(json.dumps([read(file) for file in files]))
            """
        answers = ask("gmsh", script, *self.moved("assembly.cgns", "--fixed-set", "wall"))
        self.check(answers, 12)

    def test_meshio_reads_xdmf(self):
        script = """
            import meshio
            def read(file):
                mesh = meshio.read(file)
                return [mesh.points.tolist(), [[c.type, c.data.tolist()] for c in mesh.cells],
                        {k: v.tolist() for k, v in mesh.point_data.items()},
                        {k: [a.tolist() for a in v] for k, v in mesh.cell_data.items()},
                        str(mesh.points.dtype)]
            print(json.dumps([read(file) for file in files]))
            """
        self.check(ask("meshio", script, *self.moved("mixed_meshio.xdmf")), 12)

    def test_meshio_reads_flat_xdmf_in_its_text(self):
        script = """
            import meshio
            meshes = [meshio.read(file) for file in files]
            print(json.dumps([[m.points.tolist(), [c.data.tolist() for c in m.cells]]
                              for m in meshes]))
            """
        given = FILES / "flat_inline.xdmf"
        result = self.folder / "out.xdmf"
        subprocess.run([CLI, "smooth", given, "-o", result, "--quiet"], check=True)
        points, moved = self.check(ask("meshio", script, given, result), 5)
        self.assertEqual([len(point) for point in moved], [2] * 5)

    def test_dolfinx_reads_xdmf(self):
        script = """
            from dolfinx import io
            from mpi4py import MPI
            def read(path):
                with io.XDMFFile(MPI.COMM_SELF, path, "r") as file:
                    mesh = file.read_mesh()
                    mesh.topology.create_connectivity(2, 3)
                    walls = file.read_meshtags(mesh, "walls")
                    parts = file.read_meshtags(mesh, "parts")
                # Of all nodes, by what the file calls them.
                order = mesh.geometry.input_global_indices
                points = sorted(zip(map(int, order), mesh.geometry.x.tolist()))
                cells = [[int(order[node]) for node in mesh.geometry.dofmap.links(cell)]
                         for cell in range(6)]
                tags = [[walls.values.tolist(), walls.indices.tolist()],
                        [parts.values.tolist(), parts.indices.tolist()]]
                return [points, cells, tags]
            print(json.dumps([read(file) for file in files]))
            """
        answers = ask("dolfinx", script, *self.moved("dolfinx.xdmf", "--fixed-set", "walls:3"))
        points, moved = self.check(answers, 8)
        self.assertEqual([point for point in points if point[1][0] == 0],
                         [point for point in moved if point[1][0] == 0])


if __name__ == "__main__":
    main()
