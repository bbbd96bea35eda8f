"""What paraview_test.py has run by ParaView's Python: paraview_session.py PLUGIN STEPS.json FOLDER.

Each step names a filter, its input file, and its properties; the positions and the names of its
arrays go into FOLDER. With "cancel" the filter is aborted at its first progress event, with "piece"
it is asked for that piece of two, as on the second process of a pvserver.
"""

import json
import pathlib
import sys

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy

from paraview import simple


def run(step, folder):
    source = simple.OpenDataFile(step["input"])
    if "piece" in step:  # a reader has nothing but for the first
        source.UpdatePipeline()
        mesh = source.GetClientSideObject().GetOutputDataObject(0)
        source = simple.TrivialProducer()
        source.GetClientSideObject().SetOutput(mesh)
    one = getattr(simple, step["filter"])(Input=source, **step.get("properties", {}))
    algorithm = one.GetClientSideObject()
    events = []

    def note(caller, _):
        events.append(caller.GetProgressText())
        if step.get("cancel"):
            caller.SetAbortExecute(1)

    algorithm.AddObserver("ProgressEvent", note)
    if "piece" in step:
        algorithm.UpdatePiece(step["piece"], 2, 0)
    else:
        one.UpdatePipeline()
    output = algorithm.GetOutputDataObject(0)
    points = output.GetPoints()
    if points is not None:
        numpy.save(folder / f"{step['name']}.npy", vtk_to_numpy(points.GetData()))
    summary = output.GetFieldData().GetAbstractArray("meshsmooth")
    return {
        "kind": output.GetClassName(),
        "cells": output.GetNumberOfCells(),
        "cell_arrays": [] if "piece" in step else one.CellData.keys(),
        "events": events,
        "summary": json.loads(summary.GetValue(0)) if summary else None,
    }


plugin, steps, folder = sys.argv[1:]
simple.LoadPlugin(plugin, ns=vars(simple))
found = {}
for step in json.loads(pathlib.Path(steps).read_text()):
    print(f"step {step['name']}", file=sys.stderr, flush=True)
    found[step["name"]] = run(step, pathlib.Path(folder))
pathlib.Path(folder, "found.json").write_text(json.dumps(found))
