"""Elements: the triangles of surface elements, for C++ and Python."""

from common import cpp_table, declared, python_module


def cpp_triangles():
    def case(name, triangles):
        rows = ", ".join("{" + ", ".join(map(str, nodes)) + "}" for nodes in triangles)
        return (f"case ElementType::{name}: {{\n  static constexpr Triangle kTriangles[] = {{{rows}}};\n"
                f"  return kTriangles;\n}}\n")

    return cpp_table(*(case(*found) for found in declared("elements")["triangles"].items()))


def python_triangles():
    def row(name, triangles):
        rows = ", ".join("(" + ", ".join(map(str, nodes)) + ")" for nodes in triangles)
        return f"    mesh_pb2.ELEMENT_TYPE_{name.upper()}: [{rows}],\n"

    return python_module("The triangles of surface elements, by their nodes.",
                         "from .v1 import mesh_pb2\n\n",
                         "TRIANGLES = {\n", *(row(*found) for found in declared("elements")["triangles"].items()), "}\n")


FILES = {
    "core/src/surface/element_triangles.inc": cpp_triangles,
    "client/python/src/meshsmooth/_triangles.py": python_triangles,
}
