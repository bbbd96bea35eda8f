"""Run by freecadcmd: a block of tetrahedra of second order, of which some are tangled, in a document, for the macro.

Prints what is left of it as JSON, after a line of its own."""

import json
import os

import Fem
import FreeCAD

SIDE = 3
CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1), (1, 1, 1)]
TETRAHEDRA = [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)]


def block():
    """Numbers have gaps; the centre and the middle of an edge there lie where they tangle elements."""
    mesh, numbers = Fem.FemMesh(), {}

    def node(place):
        if place not in numbers:
            numbers[place] = 10 + 3 * len(numbers)
            x, y, z = (coordinate / 2 for coordinate in place)
            if place == (2, 2, 2):
                x, y = x + 0.3, y + 0.2
            if place == (3, 3, 3):
                x, y, z = x + 0.6, y - 0.5, z + 0.4
            mesh.addNode(x, y, z, numbers[place])
        return numbers[place]

    element = 100
    for cell in ((x, y, z) for z in range(SIDE) for y in range(SIDE) for x in range(SIDE)):
        for tetrahedron in TETRAHEDRA:
            corners = [tuple(2 * (cell[axis] + CORNERS[corner][axis]) for axis in range(3)) for corner in tetrahedron]
            middles = [tuple((a + b) // 2 for a, b in zip(corners[i], corners[j]))
                       for i, j in ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))]
            mesh.addVolume([node(place) for place in corners + middles], element)
            element += 2
    body = mesh.addGroup("body", "Volume")
    mesh.addGroupElements(body, list(mesh.Volumes)[:7])
    floor = mesh.addGroup("floor", "Node")
    mesh.addGroupElements(floor, [number for place, number in numbers.items() if place[2] == 0])
    return mesh


def facts(mesh):
    return {"nodes": {number: tuple(place) for number, place in mesh.Nodes.items()},
            "elements": {element: mesh.getElementNodes(element) for element in mesh.Volumes},
            "groups": [(mesh.getGroupName(group), mesh.getGroupElementType(group), mesh.getGroupElements(group))
                       for group in mesh.Groups]}


document = FreeCAD.newDocument("part")
document.saveAs(os.environ["DOCUMENT"])
item = document.addObject("Fem::FemMeshObject", "Block")
item.FemMesh = block()
before = facts(item.FemMesh)
item.FemMesh.write(os.environ["DOCUMENT"] + ".before.unv")
with open(os.environ["MACRO"], encoding="utf-8") as macro:
    exec(compile(macro.read(), os.environ["MACRO"], "exec"), {"__name__": "__main__"})
item.FemMesh.write(os.environ["DOCUMENT"] + ".after.unv")
print("\nFACTS " + json.dumps([before, facts(item.FemMesh)]))
