"""Smooths one tetrahedron, split into four at an off-centre node, on a server at HOST:PORT, by ctypes alone.

    smooth_ctypes.py HOST:PORT [libmeshsmooth_client.so.0]

Languages that call C do as this does. Python has a package of its own, `meshsmooth`.
"""

import ctypes
import sys
from ctypes import byref, c_char_p, c_double, c_int32, c_int64, c_size_t, c_void_p, sizeof

ms = ctypes.CDLL(sys.argv[2] if len(sys.argv) > 2 else "libmeshsmooth_client.so.0")
for name in ("reason", "message", "hint"):
    getattr(ms, f"meshsmooth_error_{name}").restype = c_char_p

FLOAT64, TETRAHEDRON, OPTIMIZE, GOAL_WORST = 2, 3, 1, 3


class Block(ctypes.Structure):
    _fields_ = [("type", c_int64), ("element_count", c_int64), ("nodes", c_void_p)]


class Mesh(ctypes.Structure):
    """The first members of meshsmooth_mesh: what `size` leaves out is null."""

    _fields_ = [("size", c_size_t), ("scalar", c_int64), ("node_count", c_int64), ("positions", c_void_p),
                ("block_count", c_int64), ("blocks", c_void_p)]


class Options(ctypes.Structure):
    """The first members of meshsmooth_options: what `size` leaves out has its default."""

    _fields_ = [("size", c_size_t), ("method", c_int64), ("weighting", c_int64), ("relaxation", c_double),
                ("lambda_", c_double), ("mu", c_double), ("alpha", c_double), ("beta", c_double), ("goal", c_int64)]


class Summary(ctypes.Structure):
    """The first members of meshsmooth_summary."""

    _fields_ = [("size", c_size_t)] + [(name, c_int64) for name in (
        "stop_reason", "end_rule", "iteration_count", "node_count", "boundary_node_count", "fixed_node_count",
        "moved_node_count", "restored_node_count", "element_count", "locked_element_count", "inverted_count_before",
        "inverted_count_after")]


def call(name, *arguments):
    error = c_void_p()
    if getattr(ms, "meshsmooth_" + name)(*arguments, byref(error)):
        text = "{}: {}\n{}".format(*(getattr(ms, f"meshsmooth_error_{part}")(error).decode()
                                     for part in ("reason", "message", "hint")))
        ms.meshsmooth_error_free(error)
        sys.exit(text)


positions = (c_double * 15)(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.1, 0.1, 0.1)
nodes = (c_int32 * 16)(4, 1, 2, 3, 0, 4, 2, 3, 0, 1, 4, 3, 0, 1, 2, 4)
block = Block(TETRAHEDRON, 4, ctypes.addressof(nodes))
mesh = Mesh(sizeof(Mesh), FLOAT64, 5, ctypes.addressof(positions), 1, ctypes.addressof(block))

options = Options()
call("options_init", byref(options), c_size_t(sizeof(Options)))
options.method, options.goal = OPTIMIZE, GOAL_WORST
client, report, summary = c_void_p(), c_void_p(), Summary(size=sizeof(Summary))
call("client_create", sys.argv[1].encode(), None, byref(client))
call("smooth", client, byref(mesh), byref(options), None, positions, byref(report))
call("report_summary", report, byref(summary))
print(f"inverted: {summary.inverted_count_after}, moved: {summary.moved_node_count}")
print("node 4: {!r} {!r} {!r}".format(*positions[12:15]))
ms.meshsmooth_report_free(report)
ms.meshsmooth_client_free(client)
