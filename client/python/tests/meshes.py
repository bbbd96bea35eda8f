"""Random mixed meshes, and the same meshes as other packages hold them."""

from __future__ import annotations

import pathlib
import re
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st

VTK_NUMBERS = {
    "vertex": 1,
    "line": 3,
    "triangle": 5,
    "quad": 9,
    "tetra": 10,
    "hexahedron": 12,
    "wedge": 13,
    "pyramid": 14,
}


class Case(NamedTuple):
    """A mesh as rows in the order of the caller."""

    points: Any
    rows: list[tuple[str, tuple[int, ...]]]

    def blocks(self) -> list[tuple[str, Any]]:
        """A block for each run of rows of one type."""
        blocks: list[tuple[str, list[tuple[int, ...]]]] = []
        for name, row in self.rows:
            if not blocks or blocks[-1][0] != name:
                blocks.append((name, []))
            blocks[-1][1].append(row)
        return [(name, np.array(rows)) for name, rows in blocks]

    def meshio_blocks(self) -> list[tuple[str, Any]]:
        """The same with meshio's wedges, whose first triangle looks inward as gmsh's does."""
        turned = [0, 2, 1, 3, 5, 4]
        return [(n, a[:, turned] if n == "wedge" else a) for n, a in self.blocks()]

    def by_type(self) -> dict[str, Any]:
        names = list(dict.fromkeys(name for name, _ in self.rows))
        return {name: np.array([r for n, r in self.rows if n == name]) for name in names}

    def sorted_by_type(self) -> Case:
        """The same mesh in the order in which `by_type` numbers its cells."""
        return Case(
            self.points, [(n, tuple(map(int, r))) for n, a in self.by_type().items() for r in a]
        )

    def padded(self) -> Any:
        return np.concatenate([[len(row), *row] for _, row in self.rows])

    def offsets(self) -> Any:
        return np.cumsum([0] + [len(row) for _, row in self.rows])

    def connectivity(self) -> Any:
        return np.concatenate([row for _, row in self.rows])

    def types(self) -> Any:
        return np.array([VTK_NUMBERS[name] for name, _ in self.rows], np.uint8)

    def write_vtk(self, path: pathlib.Path) -> None:
        """VTK's old text format; the bits of the positions survive."""
        kind = "float" if self.points.dtype == np.float32 else "double"
        lines = [
            "# vtk DataFile Version 3.0\nmesh\nASCII\nDATASET UNSTRUCTURED_GRID",
            f"POINTS {len(self.points)} {kind}",
            *(" ".join(repr(float(x)) for x in point) for point in self.points),
            f"CELLS {len(self.rows)} {len(self.padded())}",
            *(f"{len(row)} {' '.join(map(str, row))}" for _, row in self.rows),
            f"CELL_TYPES {len(self.rows)}",
            *map(str, self.types()),
        ]
        path.write_text("\n".join(lines) + "\n")


def read_vtk_points(path: pathlib.Path) -> Any:
    """The points of a file of VTK's old format, in text or binary."""
    content = path.read_bytes()
    match = re.search(rb"\nPOINTS (\d+) (float|double)\n", content)
    assert match
    dtype = np.dtype(">f4" if match[2] == b"float" else ">f8")
    count = 3 * int(match[1])
    if content.split(b"\n", 3)[2] == b"ASCII":
        words = content[match.end() :].split(maxsplit=count)[:count]
        points = np.array([float(word) for word in words], dtype)
    else:
        points = np.frombuffer(content, dtype, count, match.end())
    return points.reshape(-1, 3).astype(dtype.newbyteorder("="))


def volume_case(shape: tuple[int, int, int], choices: list[int], seed: int, dtype: Any) -> Case:
    """A box of hexahedra, of which some columns become wedges and some cells six pyramids.

    Pyramids on the upper side, with a tetrahedron on each, make all four types meet.
    """
    nx, ny, nz = shape
    points = [(x, y, z) for x in range(nx + 1) for y in range(ny + 1) for z in range(nz + 1)]

    def node(x: int, y: int, z: int) -> int:
        return (x * (ny + 1) + y) * (nz + 1) + z

    rows: list[tuple[str, tuple[int, ...]]] = []
    for x in range(nx):
        for y in range(ny):
            column = choices[(x * ny + y) % len(choices)]
            for z in range(nz):
                a, b, c, d = ((0, 0), (1, 0), (1, 1), (0, 1))
                low = [node(x + i, y + j, z) for i, j in (a, b, c, d)]
                high = [node(x + i, y + j, z + 1) for i, j in (a, b, c, d)]
                if column == 0:
                    rows.append(("hexahedron", (*low, *high)))
                elif column == 1:  # VTK's wedge turns its first triangle outward
                    rows += [
                        ("wedge", tuple(side[i] for side in (high, low) for i in corners))
                        for corners in ((0, 1, 2), (0, 2, 3))
                    ]
                else:
                    points.append((x + 0.5, y + 0.5, z + 0.5))
                    faces = [low, high[::-1]]
                    faces += [
                        [low[i], high[i], high[(i + 1) % 4], low[(i + 1) % 4]] for i in range(4)
                    ]
                    rows += [("pyramid", (*face, len(points) - 1)) for face in faces]
            if column in (0, 2):
                points.append((x + 0.5, y + 0.5, nz + 0.7))
                rows.append(("pyramid", (*high, len(points) - 1)))
                points.append((x + 0.5, y - 0.3, nz + 0.7))
                rows.append(("tetra", (high[0], high[1], len(points) - 2, len(points) - 1)))
    return _shaken(points, rows, seed, dtype)


def surface_case(shape: tuple[int, int], choices: list[int], seed: int, dtype: Any) -> Case:
    """A wavy sheet of quads, some of them two triangles."""
    nx, ny = shape
    points = [(x, y, 0.2 * np.sin(x + 2 * y)) for x in range(nx + 1) for y in range(ny + 1)]
    rows: list[tuple[str, tuple[int, ...]]] = []
    for x in range(nx):
        for y in range(ny):
            q = [(x + i) * (ny + 1) + y + j for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
            if choices[(x * ny + y) % len(choices)] == 0:
                rows.append(("quad", tuple(q)))
            else:
                rows += [("triangle", (q[0], q[1], q[2])), ("triangle", (q[0], q[2], q[3]))]
    return _shaken(points, rows, seed, dtype)


def _shaken(points: Any, rows: Any, seed: int, dtype: Any) -> Case:
    random = np.random.default_rng(seed)
    shaken = np.array(points, float)
    shaken += random.uniform(-0.15, 0.15, shaken.shape)
    # Cells of lower dimension between the others, and an order that no reader would choose.
    some = [rows[i] for i in random.integers(0, len(rows), 3)]
    rows = [*rows, *(("line", row[:2]) for _, row in some), ("vertex", some[0][1][:1])]
    order = random.permutation(len(rows))
    return Case(shaken.astype(dtype), [rows[i] for i in order])


def random_case(seed: int) -> Case:
    random = np.random.default_rng(seed)
    dtype = random.choice([np.float32, np.float64])
    if seed % 3 == 0:
        nx, ny = (int(n) for n in random.integers(2, 6, 2))
        return surface_case((nx, ny), list(random.integers(0, 2, 9)), seed, dtype)
    nx, ny, nz = (int(n) for n in random.integers(1, 4, 3))
    return volume_case((nx, ny, nz), list(random.integers(0, 3, 9)), seed, dtype)


CASES = st.integers(0, 2**32 - 1).map(random_case)


_EDGES = {
    "triangle": [(0, 1), (1, 2), (2, 0)],
    "quad": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tetra": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    "pyramid": [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)],
    "wedge": [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    "hexahedron": [
        *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6)),
        *((6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
    ],
}
_FACES = {
    "wedge18": [(0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)],
    "hexahedron27": [
        *((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4)),
        *((3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
    ],
}
_CENTRES = {"quad9": [tuple(range(4))], "hexahedron27": [tuple(range(8))]}


def middles_of(name: str) -> list[tuple[int, ...]]:
    """The corners in whose middle each node after them lies, by type of second order."""
    linear = name.rstrip("0123456789")
    return [*_EDGES[linear], *_FACES.get(name, []), *_CENTRES.get(name, [])]


def second_order(points: Any, cells: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    """A mesh of tetrahedra with a node in the middle of each edge, after its own."""
    rows = cells["tetra"]
    ends = np.sort(np.concatenate([rows[:, list(of)] for of in middles_of("tetra10")]), axis=1)
    edges, place = np.unique(ends, axis=0, return_inverse=True)
    middles = place.reshape(6, len(rows)).T + len(points)
    more = np.concatenate([points, (points[edges[:, 0]] + points[edges[:, 1]]) / 2])
    return more, {"tetra10": np.concatenate([rows, middles], axis=1)}
