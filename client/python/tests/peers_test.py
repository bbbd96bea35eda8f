"""Meshes of the packages themselves; tests are skipped with the name of the package they miss."""

from __future__ import annotations

import pathlib
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from adapters_test import SETTINGS, assert_same, cli_points
from conftest import cube, run_cli
from hypothesis import given
from meshes import CASES, Case, middles_of, read_vtk_points

import meshsmooth as ms


def peer(name: str) -> Any:
    return pytest.importorskip(name, reason=f"missing package: {name}")


def pyvista_grid(case: Case) -> Any:
    grid = peer("pyvista").UnstructuredGrid(case.padded(), case.types(), case.points.copy())
    grid.point_data["t"] = np.arange(grid.n_points)
    grid.cell_data["c"] = np.arange(grid.n_cells)
    grid.field_data["note"] = ["kept"]
    return grid


@SETTINGS
@given(CASES)
def test_pyvista_grids(client: ms.Client, case: Case) -> None:
    grid = pyvista_grid(case)
    before = grid.copy()
    better = client.smooth(grid)
    assert type(better) is type(grid)
    assert grid == before
    assert np.array_equal(better.cells, grid.cells)
    assert np.array_equal(better.celltypes, grid.celltypes)
    assert np.array_equal(better.point_data["t"], grid.point_data["t"])
    assert np.array_equal(better.cell_data["c"], grid.cell_data["c"])
    assert better.field_data["note"][0] == "kept"
    assert_same(np.array(better.points), cli_points(case))


@SETTINGS
@given(CASES)
def test_vtk_grids(client: ms.Client, case: Case) -> None:
    peer("pyvista")
    support = peer("vtkmodules.util.numpy_support")
    model = peer("vtkmodules.vtkCommonDataModel")
    grid = model.vtkUnstructuredGrid()
    grid.DeepCopy(pyvista_grid(case))
    better = client.smooth(grid)
    assert type(better) is model.vtkUnstructuredGrid
    assert_same(support.vtk_to_numpy(grid.GetPoints().GetData()), case.points)
    assert_same(support.vtk_to_numpy(better.GetPoints().GetData()), cli_points(case))


@SETTINGS
@given(CASES.filter(lambda case: "tetra" not in case.by_type() and "wedge" not in case.by_type()))
def test_pyvista_surfaces(client: ms.Client, case: Case) -> None:
    pyvista = peer("pyvista")
    if any(len(row) > 4 for _, row in case.rows):
        return
    rows = [row for name, row in case.rows if name in ("triangle", "quad")]
    faces = np.concatenate([[len(row), *row] for row in rows])
    surface = pyvista.PolyData(case.points.copy(), faces, lines=np.array([2, *rows[0][:2]]))
    surface.point_data["t"] = np.arange(surface.n_points)
    better = client.smooth(surface)
    assert type(better) is pyvista.PolyData
    assert np.array_equal(better.faces, faces)
    assert np.array_equal(better.lines, surface.lines)
    assert_same(np.array(surface.points), case.points)
    names = {3: "triangle", 4: "quad"}
    cells = [("line", rows[0][:2]), *((names[len(row)], row) for row in rows)]
    assert_same(np.array(better.points), cli_points(Case(case.points, cells)))


def test_pyvista_has_a_name_for_the_element(client: ms.Client) -> None:
    points, cells = cube(4)
    rows: list[Any] = [("vertex", (0,)), ("line", (0, 1))]
    rows += [("tetra", tuple(map(int, row))) for row in cells["tetra"]]
    rows[5] = ("tetra", (0, 0, 1, 2))
    with pytest.raises(ms.InvalidMesh) as caught:
        client.smooth(pyvista_grid(Case(points, rows)))
    assert caught.value.reason == "REPEATED_NODE"
    assert (caught.value.element, caught.value.node) == (5, 0)
    assert "in the input: element 5" in str(caught.value)


def test_pyvista_gets_quality_as_a_cell_array(client: ms.Client) -> None:
    points, cells = cube(4)
    rows: list[Any] = [("line", (0, 1))]
    rows += [("tetra", tuple(map(int, row))) for row in cells["tetra"]]
    grid = pyvista_grid(Case(points, rows))
    better = client.smooth(grid, element_quality=["mean_ratio", "radius_ratio"])
    values = better.cell_data["mean_ratio"]
    assert np.isnan(values[0])
    assert (values[1:] > 0).all()
    assert "radius_ratio" in better.cell_data
    assert "mean_ratio" not in grid.cell_data


def test_pyvista_names_arrays(client: ms.Client) -> None:
    points, cells = cube(4)
    grid = pyvista_grid(Case(points, [("tetra", tuple(map(int, r))) for r in cells["tetra"]]))
    grid.point_data["hold"] = np.arange(grid.n_points) % 2
    grid.cell_data["material"] = (grid.cell_centers().points[:, 0] > 0.5).astype(int)
    better = client.smooth(grid, fixed="hold", regions="material", full=True)
    assert (better.points[1::2] == points[1::2]).all()
    assert better.summary.nodes.between_regions > 0


@pytest.mark.usefixtures("server")
def test_pyvista_accessor() -> None:
    pyvista = peer("pyvista")
    if not hasattr(pyvista, "register_dataset_accessor"):
        pytest.skip("missing package: pyvista 0.48 or later")
    import meshsmooth._pyvista  # noqa: F401, as PyVista's entry point does

    points, cells = cube(4)
    grid = pyvista_grid(Case(points, [("tetra", tuple(map(int, r))) for r in cells["tetra"]]))
    better = grid.meshsmooth.smooth(goal="worst")
    assert type(better) is pyvista.UnstructuredGrid
    assert_same(np.array(better.points), ms.smooth((points, cells), goal="worst")[0])
    assert better.meshsmooth.quality().inverted_element_count == 0
    grid.point_data["u"] = 0.1 * np.sin(grid.points)
    moved = grid.meshsmooth.move(displacement="u")
    assert type(moved) is pyvista.UnstructuredGrid
    expected = ms.move((points, cells), displacement=0.1 * np.sin(points))[0]
    assert_same(np.array(moved.points), expected)
    with grid.meshsmooth.session(method=ms.Move(start="warm")) as session:
        boundary = ((points == 0) | (points == 1)).any(axis=1)
        stepped = session.move(boundary, points + 0.1 * np.sin(points))
    assert np.allclose(stepped, expected, atol=1e-3)
    assert grid.meshsmooth.why(0) == ms.why((points, cells), 0)
    plotter = pyvista.Plotter(off_screen=True)
    drawn = grid.meshsmooth.plot_quality(below=0.9, plotter=plotter, show=False)
    assert drawn is plotter
    assert len(plotter.actors) >= 2


def test_pyvista_has_the_accessor_after_the_import() -> None:
    """From a checkout too, which has no entry points."""
    if not hasattr(peer("pyvista"), "register_dataset_accessor"):
        pytest.skip("missing package: pyvista 0.48 or later")
    code = "import pyvista, meshsmooth; print(pyvista.Sphere().meshsmooth)"
    subprocess.run([sys.executable, "-c", code], check=True)


@SETTINGS
@given(CASES)
def test_meshio_meshes(client: ms.Client, case: Case) -> None:
    meshio = peer("meshio")
    mesh = meshio.Mesh(
        case.points.copy(),
        case.meshio_blocks(),
        point_data={"t": np.arange(len(case.points))},
        cell_data={"c": [np.arange(len(nodes)) for _, nodes in case.blocks()]},
        point_sets={"some": np.array([0, 1])},
        cell_sets={"first": [np.array([0]) for _ in case.blocks()]},
    )
    better = client.smooth(mesh)
    assert type(better) is meshio.Mesh
    assert_same(mesh.points, case.points)
    for one, other in zip(better.cells, mesh.cells, strict=True):
        assert one.type == other.type
        assert np.array_equal(one.data, other.data)
    assert better.cell_data.keys() == mesh.cell_data.keys()
    assert_same(better.points, cli_points(case))
    held = client.smooth(mesh, fixed=["some", "first"])
    nodes = np.unique(np.concatenate([[0, 1], *(nodes[0] for _, nodes in case.blocks())]))
    assert (held.points[nodes] == case.points[nodes]).all()


def test_wedges_of_meshio(client: ms.Client, tmp_path: pathlib.Path) -> None:
    meshio = peer("meshio")
    run_cli("generate", "mixed", "--nodes", "300", "-o", tmp_path / "in.vtu")
    mesh = meshio.read(tmp_path / "in.vtu")
    assert any(block.type == "wedge" for block in mesh.cells)
    assert client.quality(mesh).inverted_element_count == 0
    meshio.write(tmp_path / "better.vtu", client.smooth(mesh))
    run_cli("smooth", tmp_path / "in.vtu", "-o", tmp_path / "out.vtu", "--quiet")
    expected = meshio.read(tmp_path / "out.vtu").points
    assert_same(meshio.read(tmp_path / "better.vtu").points, expected)


def test_trimesh_meshes(client: ms.Client) -> None:
    trimesh = peer("trimesh")
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.vertices += np.random.default_rng(1).normal(0, 0.02, ball.vertices.shape)
    before = ball.vertices.copy()
    better = client.smooth(ball, method="taubin", boundary="free")
    assert type(better) is trimesh.Trimesh
    assert np.array_equal(ball.vertices, before)
    assert np.array_equal(better.faces, ball.faces)
    rows = [("triangle", tuple(map(int, row))) for row in ball.faces]
    expected = cli_points(Case(np.array(before), rows), "--method", "taubin", "--boundary", "free")
    assert_same(np.array(better.vertices), expected)


@pytest.mark.parametrize("kind", ["MeshTri", "MeshQuad", "MeshTet", "MeshHex"])
def test_scikit_fem_meshes(client: ms.Client, kind: str) -> None:
    skfem = peer("skfem")
    mesh = getattr(skfem, kind)().refined(2)
    inner = mesh.interior_nodes()
    points = mesh.p.copy()
    points[:, inner] += np.random.default_rng(1).uniform(-0.04, 0.04, points[:, inner].shape)
    shaken = type(mesh)(points, mesh.t)
    stats = client.quality(shaken)
    assert stats.inverted_element_count == 0
    better = client.smooth(shaken)
    assert type(better) is type(shaken)
    assert np.array_equal(better.t, shaken.t)
    assert np.array_equal(shaken.p, points)
    boundary = mesh.boundary_nodes()
    assert np.array_equal(better.p[:, boundary], points[:, boundary])
    after = client.quality(better).metric("mean_ratio")
    before = stats.metric("mean_ratio")
    assert after is not None
    assert before is not None
    assert after.mean > before.mean


@pytest.fixture
def gmsh() -> Iterator[Any]:
    module = peer("gmsh")
    module.initialize(interruptible=False)
    module.option.setNumber("General.Terminal", 0)
    yield module
    module.finalize()


@pytest.mark.usefixtures("server")
def test_model_open_in_gmsh(gmsh: Any, tmp_path: pathlib.Path) -> None:
    box = gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    other = gmsh.model.occ.addBox(1, 0, 0, 1, 1, 1)
    gmsh.model.occ.fragment([(3, box)], [(3, other)])
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [1], name="inlet")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.25)
    gmsh.option.setNumber("Mesh.SaveAll", 1)
    gmsh.model.mesh.generate(3)
    tags, before, _ = gmsh.model.mesh.getNodes()
    source, target = tmp_path / "in.msh", tmp_path / "out.msh"
    gmsh.write(str(source))

    summary = ms.gmsh.smooth()
    assert summary.nodes.between_regions > 0
    assert summary.nodes.moved > 0
    after_tags, after, _ = gmsh.model.mesh.getNodes()
    assert np.array_equal(tags, after_tags)
    assert (np.asarray(before) != np.asarray(after)).any()

    done = run_cli("smooth", source, "-o", target, "--quiet")
    assert done.returncode == 0, done.stderr
    gmsh.open(str(target))
    cli_tags, expected, _ = gmsh.model.mesh.getNodes()
    ours = dict(zip(after_tags, np.reshape(after, (-1, 3)).tolist(), strict=True))
    theirs = dict(zip(cli_tags, np.reshape(expected, (-1, 3)).tolist(), strict=True))
    assert ours.keys() == theirs.keys()
    assert max(np.abs(np.subtract(ours[tag], theirs[tag])).max() for tag in ours) < 1e-12


def test_gmsh_orders_of_second_order(gmsh: Any) -> None:
    """Each node after the corners lies where gmsh's own element has the middle of its part."""
    from meshsmooth.gmsh import _TYPES

    for kind, (name, order) in _TYPES.items():
        _, _, degree, count, coordinates, corner_count = gmsh.model.mesh.getElementProperties(kind)
        if degree != 2 or name == "line3":
            continue
        nodes = np.array(coordinates).reshape(count, -1)
        nodes = nodes if order is None else nodes[order]
        middles = [nodes[list(of)].mean(axis=0) for of in middles_of(name)]
        assert np.allclose(nodes[corner_count:], middles), name


@pytest.mark.usefixtures("server")
def test_second_order_of_gmsh(gmsh: Any) -> None:
    gmsh.model.occ.addSphere(0, 0, 0, 1)
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.4)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)

    summary = ms.gmsh.smooth()

    assert summary.quality_before.inverted_element_count == 0
    assert summary.quality_after.inverted_element_count == 0
    assert summary.nodes.moved > 0
    surface = gmsh.model.mesh.getNodes(2, 1)[1].reshape(-1, 3)
    assert np.allclose(np.linalg.norm(surface, axis=1), 1)


@pytest.mark.usefixtures("server")
def test_gmsh_errors_have_its_tags(gmsh: Any) -> None:
    with pytest.raises(ms.InvalidMesh) as caught:
        ms.gmsh.smooth()
    assert caught.value.reason == "MESH_EMPTY"
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setNode(9, [float("nan"), 0, 0], [])
    with pytest.raises(ms.InvalidMesh) as caught:
        ms.gmsh.smooth()
    assert (caught.value.reason, caught.value.node) == ("NON_FINITE_COORDINATE", 9)
    gmsh.model.mesh.setOrder(3)
    with pytest.raises(ms.InvalidMesh, match="setOrder"):
        ms.gmsh.smooth()


def test_written_file_is_the_command_lines(client: ms.Client, tmp_path: pathlib.Path) -> None:
    """The way of a file through meshio: read, smooth, write."""
    meshio = peer("meshio")
    points, cells = cube(5)
    mesh = client.smooth(meshio.Mesh(points, cells))
    meshio.write(tmp_path / "better.vtu", mesh)
    case = Case(points, [("tetra", tuple(map(int, row))) for row in cells["tetra"]])
    case.write_vtk(tmp_path / "in.vtk")
    run_cli("smooth", tmp_path / "in.vtk", "-o", tmp_path / "out.vtk", "--quiet")
    expected = read_vtk_points(tmp_path / "out.vtk")
    assert_same(meshio.read(tmp_path / "better.vtu").points, expected)


def shaken(mesh: Any, seed: int = 3) -> Any:
    """The same with the inner nodes of a unit cube moved."""
    points = np.array(mesh.points, float)
    inner = ((points > 1e-6) & (points < 1 - 1e-6)).all(axis=1)
    points[inner] += np.random.default_rng(seed).uniform(-0.08, 0.08, (int(inner.sum()), 3))
    mesh.points = points
    return mesh


def test_pyvista_structured_grids(client: ms.Client) -> None:
    pyvista = peer("pyvista")
    axes = np.meshgrid(*[np.linspace(0, 1, 5)] * 3, indexing="ij")
    grid = shaken(pyvista.StructuredGrid(*axes))
    better = client.smooth(grid, element_quality="mean_ratio")
    assert type(better) is pyvista.StructuredGrid
    assert better.dimensions == grid.dimensions
    assert len(better.cell_data["mean_ratio"]) == grid.n_cells
    as_cells = client.smooth(grid.cast_to_unstructured_grid())
    assert_same(np.array(better.points), np.array(as_cells.points))


def test_pyvista_images_become_grids_of_hexahedra(client: ms.Client) -> None:
    pyvista = peer("pyvista")
    image = pyvista.ImageData(dimensions=(7, 7, 7), spacing=(1 / 6,) * 3)
    centres = image.cell_centers().points
    image.cell_data["label"] = (np.linalg.norm(centres - 0.5, axis=1) < 0.33).astype(int)
    assert client.quality(image).inverted_element_count == 0
    result = client.smooth(image, regions="label", boundary="slide", full=True)
    assert type(result.mesh) is pyvista.UnstructuredGrid
    assert result.mesh.n_cells == image.n_cells
    assert result.summary.nodes.between_regions > 0
    assert (result.mesh.cell_data["label"] == image.cell_data["label"]).all()
    assert result.summary.quality_after.inverted_element_count == 0
    plane = pyvista.ImageData(dimensions=(4, 4, 1))
    assert client.quality(plane).element_count == 9
    core = peer("vtkmodules.vtkCommonDataModel")
    plain = core.vtkImageData()
    plain.DeepCopy(image)
    assert client.quality(plain).element_count == image.n_cells


def test_pyvista_blocks_are_one_mesh(client: ms.Client) -> None:
    pyvista = peer("pyvista")
    points, cells = cube(5)
    whole = pyvista_grid(Case(points, [("tetra", tuple(map(int, r))) for r in cells["tetra"]]))
    left = whole.cell_centers().points[:, 0] < 0.5
    halves = [whole.extract_cells(np.flatnonzero(side)) for side in (left, ~left)]
    blocks = pyvista.MultiBlock({"left": halves[0], "none": None})
    blocks["nested"] = pyvista.MultiBlock({"right": halves[1]})
    before = [np.array(half.points) for half in halves]
    result = client.smooth(
        blocks, merge_coincident=True, element_quality="mean_ratio", full=True, quality="brief"
    )
    better = result.mesh
    assert type(better) is pyvista.MultiBlock
    assert better.keys() == blocks.keys()
    moved = [better["left"], better["nested"]["right"]]
    expected = np.array(client.smooth(whole).points)
    for half, block, old in zip(halves, moved, before, strict=True):
        assert_same(np.array(half.points), old)
        near = expected[half.point_data["vtkOriginalPointIds"]]
        assert np.allclose(block.points, near, atol=0.02)  # the order of the cells differs
        assert len(block.cell_data["mean_ratio"]) == half.n_cells
    assert result.summary.nodes.isolated == 25  # those that another one stands for


def test_meshio_containers_are_the_results_own(client: ms.Client) -> None:
    meshio = peer("meshio")
    points, cells = cube(4)
    mesh = meshio.Mesh(points, cells, point_data={"t": points[:, 0]}, point_sets={"a": [0]})
    better = client.smooth(mesh)
    better.point_data["new"] = points[:, 1]
    better.point_sets["b"] = [1]
    better.field_data["c"] = [1, 2]
    better.cells.append(meshio.CellBlock("vertex", np.array([[0]])))
    assert (list(mesh.point_data), list(mesh.point_sets)) == (["t"], ["a"])
    assert not mesh.field_data
    assert len(mesh.cells) == 1


def test_periodic_nodes_of_gmsh_and_meshio_stay_matched(
    client: ms.Client, gmsh: Any, tmp_path: pathlib.Path
) -> None:
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    ends = {
        x: [
            tag
            for _, tag in gmsh.model.getEntitiesInBoundingBox(x - e, -e, -e, x + e, 1 + e, 1 + e, 2)
        ]
        for e in [1e-3]
        for x in (0, 1)
    }
    shift = [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    gmsh.model.mesh.setPeriodic(2, ends[1], ends[0], shift)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
    gmsh.model.mesh.generate(3)
    gmsh.write(str(tmp_path / "box.msh"))
    mesh = peer("meshio").read(tmp_path / "box.msh")
    slave, master = mesh.gmsh_periodic[-1][-1].T
    assert len(slave) > 9

    better = client.smooth(mesh, boundary="slide", full=True)
    count = len({*np.concatenate([slave, master]).tolist()})
    assert better.summary.nodes.paired == count
    moved = better.mesh.points
    assert np.array_equal(moved[slave] - moved[master], mesh.points[slave] - mesh.points[master])
    with client.session(mesh, boundary="slide") as session:
        assert session.smooth(full=True).summary.nodes.paired == count

    summary = ms.gmsh.smooth(boundary="slide")
    assert summary.nodes.paired == count
