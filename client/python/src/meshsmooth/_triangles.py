"""The triangles of surface elements, by their nodes.

Made by scripts/tables from proto/declaration; do not edit.
"""
# fmt: off
# ruff: noqa: E501

from __future__ import annotations

from .v1 import mesh_pb2

TRIANGLES = {
    mesh_pb2.ELEMENT_TYPE_TRIANGLE: [(0, 1, 2)],
    mesh_pb2.ELEMENT_TYPE_QUAD: [(0, 1, 2), (0, 2, 3)],
    mesh_pb2.ELEMENT_TYPE_TRIANGLE6: [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)],
    mesh_pb2.ELEMENT_TYPE_QUAD8: [(0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 6), (4, 6, 7)],
    mesh_pb2.ELEMENT_TYPE_QUAD9: [(0, 4, 8), (4, 1, 8), (1, 5, 8), (5, 2, 8), (2, 6, 8), (6, 3, 8), (3, 7, 8), (7, 0, 8)],
}
