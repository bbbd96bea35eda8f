"""ParaView's filters "meshsmooth: Smooth" and "meshsmooth: Move".

Load this file by Tools > Manage Plugins, or by LoadPlugin(path, ns=globals()) in a script. It needs
the package meshsmooth in ParaView's Python: docs/python.md ("ParaView").
"""

import contextlib
import importlib.util
import os

from paraview.util.vtkAlgorithm import VTKPythonAlgorithmBase, smhint, smproperty, smproxy
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkDataObject

# <!-- table: choices -->
METHODS = (
    "optimize",
    "smart-laplacian",
    "laplacian",
    "weighted-laplacian",
    "taubin",
    "hc-laplacian",
    "windowed-sinc",
)
GOALS = ("average", "balanced", "worst")
BOUNDARIES = ("fixed", "slide", "free")
# <!-- end of table -->
NO_ARRAY = "(none)"

# --- the properties, in ParaView's XML: its decorators for methods sort them by name --------------

_INPUT = """
    <InputProperty name="Input" command="SetInputConnection">
      <ProxyGroupDomain name="groups">
        <Group name="sources"/><Group name="filters"/>
      </ProxyGroupDomain>
      <DataTypeDomain name="input_type" composite_data_supported="0">
        <DataType value="vtkUnstructuredGrid"/><DataType value="vtkPolyData"/>
      </DataTypeDomain>
      <InputArrayDomain name="points" attribute_type="point" optional="1"/>
      <InputArrayDomain name="cells" attribute_type="cell" optional="1"/>
    </InputProperty>"""


def _property(kind, name, label, default, text, inside="", attributes=""):
    return f"""
    <{kind}VectorProperty name="{name}" label="{label}" command="Set{name}" number_of_elements="1"
                          default_values="{default}" {attributes}>
      {inside}
      <Documentation>{text}</Documentation>
    </{kind}VectorProperty>"""


def _choice(name, names, default, text, hints=""):
    entries = "".join(f'<Entry value="{i}" text="{n}"/>' for i, n in enumerate(names))
    inside = f'<EnumerationDomain name="enum">{entries}</EnumerationDomain>{hints}'
    return _property("Int", name, name, names.index(default), text, inside)


def _array(name, label, text, of="points", kind="Scalars", none=NO_ARRAY):
    none_string = f'none_string="{none}"' if none else ""
    inside = f"""
      <ArrayListDomain name="array_list" attribute_type="{kind}" input_domain_name="{of}"
                       {none_string}>
        <RequiredProperties><Property name="Input" function="Input"/></RequiredProperties>
      </ArrayListDomain>"""
    return _property("String", name, label, none, text, inside)


def _number(kind, name, label, default, text, limits, attributes=""):
    domain = f'<{kind}RangeDomain name="range" {limits}/>'
    return _property(kind, name, label, default, text, domain, attributes)


_ADVANCED = 'panel_visibility="advanced"'
_COMMON = (
    _choice(
        "Boundary",
        BOUNDARIES,
        "fixed",
        "Nodes of the boundary and between regions stay; or slide in planes, along edges and on "
        "curved parts; or move as all others.",
    )
    + _number(
        "Double",
        "FeatureAngle",
        "Feature Angle",
        30,
        "Edges at which facets turn by more degrees are kept.",
        'min="0" max="180"',
        _ADVANCED,
    )
    + _array("FixedNodes", "Fixed Nodes", "Nodes at which this array is not 0 stay.")
    + _array(
        "Regions",
        "Regions",
        "Facets between different whole numbers of this array are kept as the boundary is.",
        of="cells",
    )
    + _property(
        "Int",
        "ElementQuality",
        "Element Quality",
        1,
        "Adds the cell arrays mean_ratio and scaled_jacobian.",
        '<BooleanDomain name="bool"/>',
    )
    + _property(
        "String",
        "Server",
        "Server",
        "",
        "HOST:PORT; empty: that of $MESHSMOOTH_SERVER, else a local one.",
    )
    + _number(
        "Double",
        "Timeout",
        "Timeout",
        0,
        "Time for the whole call in seconds; 0: no limit.",
        'min="0"',
        _ADVANCED,
    )
)
_SMOOTH = (
    _choice("Method", METHODS, "optimize", "The methods of docs/methods.md.")
    + _choice(
        "Goal",
        GOALS,
        "balanced",
        "What the method optimize improves most: the average, the worst elements, or both.",
        '<Hints><PropertyWidgetDecorator type="GenericDecorator" mode="visibility" '
        'property="Method" value="0"/></Hints>',
    )
    + _number(
        "Int",
        "Iterations",
        "Iterations",
        -1,
        "The most iterations; -1: the method's own limit; 0: quality alone.",
        'min="-1"',
    )
    + _number(
        "Double",
        "MovementLimit",
        "Movement Limit",
        0,
        "No node ends farther from its input position than this percentage of the bounding box's "
        "diagonal; 0: no limit.",
        'min="0" max="100"',
    )
)
_MOVE = _array(
    "Displacement", "Displacement", "One vector for each node.", kind="Vectors", none=""
) + _array(
    "Prescribed",
    "Prescribed Nodes",
    "Nodes at which this array is not 0 move by the displacement; (none): the boundary.",
)

# --- the filters ----------------------------------------------------------------------------------


def _import_meshsmooth():
    # ParaView exports the symbols of a protobuf of its own, and protobuf's C++ implementation for
    # Python (Debian's packages) would bind to them and crash. Wheels have another implementation.
    with contextlib.suppress(ModuleNotFoundError):
        if importlib.util.find_spec("google.protobuf.pyext._message") is not None:
            os.environ.setdefault("PROTOCOL_BUFFERS_PYTHON_IMPLEMENTATION", "python")
    import meshsmooth

    return meshsmooth


def _warn(text):
    vtkOutputWindow.GetInstance().DisplayWarningText(f"meshsmooth: {text}\n")


class _Filter(VTKPythonAlgorithmBase):
    """What both filters share: the call, its options, progress, cancelling and errors."""

    def __init__(self):
        super().__init__(nInputPorts=1, inputType="vtkPointSet", outputType="vtkPointSet")
        self._options = {}
        self._element_quality = True
        self._server = ""
        self._client_of = {}

    def RequestDataObject(self, request, inputs, outputs):  # noqa: N802, VTK's name
        """Makes an output of the input's class."""
        mesh, output = self.GetInputData(inputs, 0, 0), self.GetOutputData(outputs, 0)
        if output is None or output.GetClassName() != mesh.GetClassName():
            outputs.GetInformationObject(0).Set(vtkDataObject.DATA_OBJECT(), mesh.NewInstance())
        return 1

    def RequestData(self, request, inputs, outputs):  # noqa: N802
        """Has the mesh smoothed or moved. A cancelled job leaves the output empty."""
        mesh, output = self.GetInputData(inputs, 0, 0), self.GetOutputData(outputs, 0)
        if mesh.GetNumberOfCells() == 0:  # of a process without data, too
            output.ShallowCopy(mesh)
            return 1
        try:
            ms = _import_meshsmooth()
        except ImportError as error:
            return self._fail(f"{error}; ParaView's Python needs the package: docs/python.md")
        if outputs.GetInformationObject(0).Get(self.GetExecutive().UPDATE_PIECE_NUMBER()):
            return self._fail("the mesh is distributed over processes; gather it on one first")
        try:
            result = self._run(self._client(ms), mesh)
        except ms.Cancelled:
            _warn("cancelled")
            return 1
        except (ms.Error, TypeError, ValueError) as error:
            return self._fail(str(error))
        self._report(result)
        output.ShallowCopy(result.mesh)
        return 1

    def _run(self, client, mesh):
        raise NotImplementedError

    def _call_options(self):
        quality = ["mean_ratio", "scaled_jacobian"] if self._element_quality else None
        options = self._options | {"element_quality": quality, "progress": self._progress}
        # The server refuses an angle that means nothing.
        if options.get("boundary") != "slide" and options.get("method") != "optimize":
            options["feature_angle"] = None
        return {name: value for name, value in options.items() if value is not None}

    def _client(self, ms):
        if not self._server:
            return ms.default_client()
        if self._server not in self._client_of:
            self._client_of = {self._server: ms.Client(self._server)}
        return self._client_of[self._server]

    def _progress(self, report):
        # How many iterations it will be is not known: the bar approaches its end.
        self.SetProgressText(str(report))
        self.UpdateProgress(report.iteration / (report.iteration + 10))
        # From VTK 9.3 on CheckAbort also sees that a filter further down was aborted.
        return not getattr(self, "CheckAbort", self.GetAbortExecute)()

    def _report(self, result):
        text = vtkStringArray()
        text.SetName("meshsmooth")
        text.InsertNextValue(result.summary.to_json())
        result.mesh.GetFieldData().AddArray(text)
        if inverted := result.summary.quality_after.inverted_element_count:
            _warn(f"{inverted} elements are still inverted")

    def _fail(self, text):
        vtkOutputWindow.GetInstance().DisplayErrorText(f"meshsmooth: {text}\n")
        return 0

    def _set(self, option, value):
        if self._options.get(option) != value:
            self._options[option] = value
            self.Modified()

    def _set_array(self, option, name):
        self._set(option, None if name in (None, "", NO_ARRAY) else name)

    def SetBoundary(self, value):  # noqa: N802
        """Sets what nodes of the boundary may do, as an index into BOUNDARIES."""
        self._set("boundary", BOUNDARIES[value])

    def SetFeatureAngle(self, degrees):  # noqa: N802
        """Sets the angle beyond which an edge between facets is kept."""
        self._set("feature_angle", degrees)

    def SetFixedNodes(self, name):  # noqa: N802
        """Sets the point array that is not 0 at nodes that stay."""
        self._set_array("fixed", name)

    def SetRegions(self, name):  # noqa: N802
        """Sets the cell array of whole numbers between which facets are kept."""
        self._set_array("regions", name)

    def SetElementQuality(self, value):  # noqa: N802
        """Sets whether the result has the cell arrays mean_ratio and scaled_jacobian."""
        if self._element_quality != bool(value):
            self._element_quality = bool(value)
            self.Modified()

    def SetServer(self, address):  # noqa: N802
        """Sets the address of the server; empty: as `meshsmooth.smooth` finds one."""
        if self._server != (address or ""):
            self._server = address or ""
            self.Modified()

    def SetTimeout(self, seconds):  # noqa: N802
        """Sets the time for a call in seconds; 0: no limit."""
        self._set("timeout", seconds or None)


@smproxy.filter(name="MeshsmoothSmooth", label="meshsmooth: Smooth", support_reload=False)
@smhint.xml('<ShowInMenu category="meshsmooth"/>')
@smproperty.xml(_INPUT + _SMOOTH + _COMMON)
class MeshsmoothSmooth(_Filter):
    """Improves a mesh by moving its nodes; valid elements stay valid."""

    def __init__(self):
        super().__init__()
        self._options["method"] = "optimize"
        self._goal = "balanced"

    def _run(self, client, mesh):
        options = self._call_options()
        if options["method"] == "optimize":
            options["goal"] = self._goal
        return client.smooth(mesh, full=True, **options)

    def SetMethod(self, value):  # noqa: N802
        """Sets the method, as an index into METHODS."""
        self._set("method", METHODS[value])

    def SetGoal(self, value):  # noqa: N802
        """Sets the goal of `optimize`, as an index into GOALS."""
        if self._goal != GOALS[value]:
            self._goal = GOALS[value]
            self.Modified()

    def SetIterations(self, count):  # noqa: N802
        """Sets the most iterations; -1: the method's own limit."""
        self._set("iterations", None if count < 0 else count)

    def SetMovementLimit(self, percent):  # noqa: N802
        """Sets how far nodes may end from their input positions, in percent of the diagonal."""
        self._set("movement_limit", f"{percent}%" if percent else None)


@smproxy.filter(name="MeshsmoothMove", label="meshsmooth: Move", support_reload=False)
@smhint.xml('<ShowInMenu category="meshsmooth"/>')
@smproperty.xml(_INPUT + _MOVE + _COMMON)
class MeshsmoothMove(_Filter):
    """Displaces the boundary of a valid mesh; the rest follows and stays valid."""

    def _run(self, client, mesh):
        result = client.move(mesh, full=True, **self._call_options())
        if (reached := result.summary.motion.reached) < 1:
            _warn(f"the mesh could follow {100 * reached:.3g} % of the displacement")
        return result

    def SetDisplacement(self, name):  # noqa: N802
        """Sets the point array of the displacement."""
        self._set_array("displacement", name)

    def SetPrescribed(self, name):  # noqa: N802
        """Sets the point array that is not 0 at nodes that the displacement moves."""
        self._set_array("prescribed", name)
