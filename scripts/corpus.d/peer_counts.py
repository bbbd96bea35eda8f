"""Counts nodes and elements of mesh files by programs of others: VTK, meshio, pyNastran.

    peer_counts.py < LIST     LIST has "ID<TAB>PATH" lines; prints an object of JSON a line

Runs in the virtual environment that scripts/corpus makes; each file in a process of its own.
"""

import collections
import json
import os
import pathlib
import resource
import sys
import warnings

BY_VTK = {"vtk", "vtu", "vtp", "stl", "ply", "obj"}
BY_MESHIO = {"msh", "mesh", "meshb", "su2", "inp", "exo", "e", "g", "ex2", "med", "xdmf", "unv", "node"}
# VTK's numbers of cells that are others with the nodes in another order.
SAME = {8: 9, 11: 12}
# Of bar-like elements and single nodes nothing is compared: programs differ in which they count.
DIMENSION_BELOW_2 = {0, 1, 2, 3, 4, 21, 35, 68}


def count_vtk(path):
    import pyvista
    data = pyvista.read(path)
    cells = collections.Counter()
    if isinstance(data, pyvista.PolyData):
        kinds = [3] * data.n_verts + [3] * data.n_lines
        sizes = collections.Counter()
        faces, at = data.faces, 0
        while at < len(faces):
            sizes[int(faces[at])] += 1
            at += faces[at] + 1
        del kinds
        for size, count in sizes.items():
            cells[{3: 5, 4: 9}.get(size, 7)] += count
        cells[6] += data.n_strips
        return {"peer": "VTK", "nodes": data.n_points, "cells": cells}
    if not isinstance(data, pyvista.UnstructuredGrid):
        return {"peer": "VTK", "problem": type(data).__name__}
    for kind in data.celltypes:
        cells[int(kind)] += 1
    return {"peer": "VTK", "nodes": data.n_points, "cells": cells}


def count_meshio(path):
    import meshio
    from meshio._vtk_common import meshio_to_vtk_type
    mesh = meshio.read(path)
    cells = collections.Counter()
    for block in mesh.cells:
        number = meshio_to_vtk_type.get(block.type)
        if number is None:
            return {"peer": "meshio", "problem": block.type}
        cells[number] += len(block.data)
    return {"peer": "meshio", "nodes": len(mesh.points), "cells": cells}


CARDS = {"CTRIA3": 5, "CTRIAR": 5, "CQUAD4": 9, "CQUADR": 9, "CSHEAR": 9, "CTRIA6": 22, "CQUAD8": 23,
         "CTRIAX6": 22}
SOLIDS = {("CTETRA", 4): 10, ("CTETRA", 10): 24, ("CHEXA", 8): 12, ("CHEXA", 20): 25,
          ("CPENTA", 6): 13, ("CPENTA", 15): 26, ("CPYRAM", 5): 14, ("CPYRAM", 13): 27}


def count_nastran(path):
    from pyNastran.bdf.bdf import read_bdf
    model = read_bdf(path, xref=False, validate=False, debug=None,
                     punch=not has_executive_control(path))
    cells = collections.Counter()
    for element in model.elements.values():
        if element.type in CARDS:
            if all(element.node_ids):
                cells[CARDS[element.type]] += 1
        elif element.type in ("CTETRA", "CHEXA", "CPENTA", "CPYRAM"):
            ids = element.node_ids
            number = SOLIDS.get((element.type, len(ids)))
            if number is not None and all(ids):
                cells[number] += 1
    return {"peer": "pyNastran", "nodes": len(model.nodes), "cells": cells}


def has_executive_control(path):
    with open(path, "rb") as file:
        return any(line.upper().startswith((b"CEND", b"BEGIN")) for line in file)


def count(path):
    extension = pathlib.Path(path).suffix.lower().lstrip(".")
    if extension in BY_VTK:
        counted = count_vtk(path)
    elif extension in ("bdf", "nas"):
        counted = count_nastran(path)
    elif extension in BY_MESHIO:
        counted = count_meshio(path)
    else:
        return {"problem": "no peer"}
    if "cells" in counted:
        cells = collections.Counter()
        for kind, number in counted["cells"].items():
            if kind not in DIMENSION_BELOW_2 and number:
                cells[SAME.get(kind, kind)] += number
        counted["cells"] = {str(kind): number for kind, number in sorted(cells.items())}
    return counted


def count_in_child(name, path, pipe):
    resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
    resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
        try:
            counted = count(path)
        except BaseException as error:  # whatever it is: this peer does not read it
            counted = {"problem": f"{type(error).__name__}: {error}"[:200]}
    os.write(pipe, (json.dumps({"id": name, **counted}, default=int) + "\n").encode())


def main():
    warnings.simplefilter("ignore")
    import meshio  # noqa: F401  imported once, for all forks
    import pyvista
    import pyNastran.bdf.bdf  # noqa: F401
    pyvista.vtk_snake_case = "allow"
    for line in sys.stdin:
        name, path = line.rstrip("\n").split("\t", 1)
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reader)
            try:
                count_in_child(name, path, writer)
            finally:
                os._exit(0)
        os.close(writer)
        with os.fdopen(reader) as pipe:
            text = pipe.read()
        os.waitpid(child, 0)
        print(text or json.dumps({"id": name, "problem": "ended by a signal"}) + "\n", end="", flush=True)


if __name__ == "__main__":
    main()
