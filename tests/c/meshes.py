"""Meshes for the C library in plain lists, and as it takes them."""

import ctypes
import random
import struct
from itertools import permutations, product

import header

CONSTANTS = header.constants()
MeshStruct = header.structure("meshsmooth_mesh")
BlockStruct = header.structure("meshsmooth_block")


def array(kind, values):
    return (kind * len(values))(*values)


class Mesh:
    """A unit cube of n x n x n cubes of six tetrahedra each, whose inner nodes are off their places."""

    def __init__(self, n=6, seed=1, jitter=0.3):
        side, chance = n + 1, random.Random(seed)
        self.coordinates, self.inner = [], []
        for node, ijk in enumerate(product(range(side), repeat=3)):
            inner = all(0 < index < n for index in ijk)
            self.coordinates += [(index + (chance.uniform(-jitter, jitter) if inner else 0)) / n for index in ijk]
            if inner:
                self.inner.append(node)
        self.tetrahedra = []
        for corner in product(range(n), repeat=3):
            for order in permutations(range(3)):  # the six paths along edges from corner to corner
                path, at = [], list(corner)
                for axis in (None, *order):
                    if axis is not None:
                        at[axis] += 1
                    path.append((at[0] * side + at[1]) * side + at[2])
                even = order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
                self.tetrahedra += path if even else [path[1], path[0], *path[2:]]
        self.node_count, self.element_count = side**3, len(self.tetrahedra) // 4
        # Nodes of one side, and where they go.
        self.prescribed = [node for node in range(self.node_count) if self.coordinates[3 * node] == 1]
        self.places = [value + (0.2 if axis == 0 else 0) for node in self.prescribed
                       for axis, value in enumerate(self.coordinates[3 * node:3 * node + 3])]

    def in_bytes(self):
        """As cpp_client reads it."""
        return (struct.pack("3q", self.node_count, self.element_count, len(self.prescribed)) +
                bytes(array(ctypes.c_double, self.coordinates)) + bytes(array(ctypes.c_int32, self.tetrahedra)) +
                bytes(array(ctypes.c_int32, self.prescribed)) + bytes(array(ctypes.c_double, self.places)))

    def positions(self, kind=ctypes.c_double):
        return array(kind, self.coordinates)

    def as_c(self, positions, **members):
        """The structure, and what it points to: keep both."""
        nodes = array(ctypes.c_int32, self.tetrahedra)
        blocks = (BlockStruct * 1)(BlockStruct(CONSTANTS["MESHSMOOTH_TETRAHEDRON"], self.element_count,
                                               ctypes.addressof(nodes)))
        scalar = "FLOAT64" if isinstance(positions, ctypes.c_double * len(positions)) else "FLOAT32"
        mesh = MeshStruct(size=ctypes.sizeof(MeshStruct), scalar=CONSTANTS["MESHSMOOTH_" + scalar],
                          node_count=self.node_count, positions=ctypes.addressof(positions), block_count=1,
                          blocks=ctypes.addressof(blocks))
        for name, value in members.items():
            setattr(mesh, name, ctypes.addressof(value) if isinstance(value, ctypes.Array) else value)
        mesh.kept = [positions, nodes, blocks, members]
        return mesh
