"""From the arrays of a result to what the caller gets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _options
from ._adapter import Adapter
from ._adapters import find_adapter
from ._checks import check_bool, check_options
from ._decode_summary import decode_summary
from ._errors import misplaced, out_of_range
from ._job_options import MOVE_OPTIONS, JobOptions, MoveOptions
from ._mesh import Mesh
from ._methods import Metric
from ._prescribed import prescribe_motion
from ._progress import enum_name
from ._received import Result
from ._request import Request
from ._summary import Summary
from ._topology import Topology
from ._transfer import Held
from ._warn import warn_caller
from .v1 import smoothing_pb2 as pb

M = TypeVar("M")


@dataclass(frozen=True)
class SmoothResult(Generic[M]):
    """A smoothed mesh and the report on its job.

    Attributes:
        mesh: of the kind that was smoothed; the positions, if `out` was given.
        points: the positions, in the shape and type of the input's.
        summary: the report.
        element_quality: float32 values by metric, one per cell of the input; NaN where a cell has
            no such metric. Empty unless `element_quality` was asked for.
        job_name: the server's name of the job, "jobs/…".
        request_id: the UUID of the request.
    """

    mesh: M
    points: NDArray[Any]
    summary: Summary
    element_quality: dict[str, NDArray[np.float32]]
    job_name: str
    request_id: str
    _before: Mesh | None = field(default=None, repr=False, compare=False)
    _plot_change: ClassVar[Callable[..., Any]]  # set by _plot.py, which starts jobs itself

    def plot(
        self,
        metric: Metric = "mean_ratio",
        *,
        below: float | None = None,
        show: bool = True,
        **keywords: Any,
    ) -> Any:
        """Shows the mesh before and after, side by side with one camera; needs PyVista.

        Args:
            metric: by which elements are coloured.
            below: elements with a lower value are solid, the rest translucent [the worst 5 %].
            show: open the window or the notebook's view.
            **keywords: for `Plotter.add_mesh`.

        Returns:
            The plotter.

        Raises:
            ValueError: the result was pickled or written over its input, which is gone.
        """
        if self._before is None:
            raise ValueError("the mesh before is gone: overwritten by out=, left behind by pickle")
        after = self._before.moved(self.points)
        return self._plot_change(self._before, after, metric, below, show, keywords)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_before": None}  # the caller has it

    def __str__(self) -> str:
        return str(self.summary)

    def __repr__(self) -> str:
        what = f"{type(self.mesh).__name__} of {len(self.points):,} nodes"
        return f"<meshsmooth.SmoothResult: {what}, {self.summary.stop_reason}>"

    def _repr_html_(self) -> str:
        return self.summary._repr_html_()


class Finish:
    """Makes the caller's result of the wire's, with as few copies as possible.

    Attributes:
        memory: where the positions may be received; None: in new memory.
        held: where the positions stay if they do not arrive in chunks; None: they are copied.
        warning: what is wrong with the result, for who does not read the summary; "" if nothing is.
    """

    def __init__(
        self,
        request: Request,
        out: NDArray[Any] | None,
        full: bool,
        write: Callable[[NDArray[Any]], Any],
        adapter: Adapter | None = None,
        memory: NDArray[Any] | None = None,
        held: Held | None = None,
    ) -> None:
        check_bool("full", full)
        self._request = request
        self.held = held
        self._out = out
        self._full = full
        self._write = write
        self._adapter = adapter
        self.memory = _fitting(memory, request.points)
        self.own_memory: NDArray[Any] | None = None  # that another job may use again
        self.warning = ""
        self._overwritten = False  # the input's positions, by the result's
        shown = out is None and adapter is not None and adapter.annotate is not None
        if request.metrics and not full and not shown:
            raise misplaced(
                "element_quality",
                "element_quality needs full=True where the result has no cell arrays: it is "
                "result.element_quality then",
            )
        if out is None:
            return
        mesh = request.mesh
        if not isinstance(out, np.ndarray):
            raise out_of_range(
                "out", f"out must be a NumPy array to write to, it is a {type(out).__name__}"
            )
        if out.shape != (mesh.node_count, mesh.width):
            raise out_of_range(
                "out",
                f"out needs the shape {(mesh.node_count, mesh.width)}, it has {np.shape(out)}",
            )
        if not out.flags.writeable or out.dtype.kind != "f":
            raise out_of_range("out", "out must be a writable array of floats")
        self._overwritten = bool(np.may_share_memory(out, request.points))
        # Until all has arrived, the input may have to be sent again.
        if not self._overwritten:
            direct = _fitting(out, request.points)
            self.memory = self.memory if direct is None else direct

    def __call__(self, result: Result, job_name: str) -> Any:
        """Returns what `smooth` returns."""
        positions, quality, message = result.take()
        request, mesh = self._request, self._request.mesh
        if result.in_place and self.held is None:
            positions = self._copied(positions)
        if request.topology.representatives is not None:
            positions[...] = positions[request.topology.representatives]
        points = mesh.from_wire(positions)
        if self._out is not None:
            if positions is not self._out:
                self._out[...] = points
                self.own_memory = positions
            points = self._out
        named = {
            enum_name(pb.QualityMetric, "QUALITY_METRIC_", metric): mesh.elements_to_cells(values)
            for metric, values in zip(request.metrics, quality, strict=True)
        }
        smoothed: Any = points
        if self._out is None:
            smoothed = self._write(points)
            if self._adapter is not None and self._adapter.annotate is not None:
                for name, values in named.items():
                    self._adapter.annotate(smoothed, name, values)
        if not self._full:
            self.warning = _shortcomings(message)
            return smoothed
        summary = decode_summary(message, mesh.caller_element)
        before = None if self._overwritten else mesh
        return SmoothResult(smoothed, points, summary, named, job_name, request.request_id, before)

    def warn(self) -> None:
        """Warns of the result, at the caller's line; in the thread that gives it to the caller."""
        if self.warning:
            warn_caller(self.warning)

    def _copied(self, positions: NDArray[Any]) -> NDArray[Any]:
        memory = _fitting(self._out, positions)
        if memory is None:
            memory = np.empty_like(positions) if self.memory is None else self.memory
        np.copyto(memory, positions)
        return memory


def _shortcomings(message: pb.Summary) -> str:
    """What must not go unsaid where the summary is not returned."""
    what = []
    if message.HasField("motion") and message.motion.reached < 1:
        what.append(f"move reached {100 * message.motion.reached:.4g} % of the motion")
    before, after = message.quality_before, message.quality_after
    if after.inverted_element_count:
        what.append(
            f"{after.inverted_element_count:,} of {after.element_count:,} elements of the result "
            f"are inverted; {before.inverted_element_count:,} were before"
        )
    if not what:
        return ""
    return f"{', and '.join(what)}; with full=True the summary tells what is in the way"


def _fitting(memory: NDArray[Any] | None, points: NDArray[Any]) -> NDArray[Any] | None:
    if memory is None or memory.shape != points.shape or memory.dtype != points.dtype:
        return None
    return memory if memory.flags.c_contiguous and memory.flags.writeable else None


def prepare(
    mesh: Any, options: JobOptions, out: NDArray[Any] | None, full: bool
) -> tuple[Request, Finish]:
    """Reads a mesh and the options of a job."""
    adapter = find_adapter(mesh)
    request = Request(Mesh(adapter.read(mesh)), options)
    return request, Finish(request, out, full, lambda points: adapter.write(mesh, points), adapter)


def prepare_move(
    mesh: Any, options: MoveOptions, out: NDArray[Any] | None, full: bool
) -> tuple[Request, Finish]:
    """Reads a mesh to move and the options of the job."""
    adapter = find_adapter(mesh)
    own = Mesh(adapter.read(mesh))
    check_options(options, MOVE_OPTIONS)
    job_options = _options.to_move_options(options)
    topology = Topology.of(own, options)
    prescribed = prescribe_motion(own, topology, options)
    moving = topology.moving(own.points, prescribed.nodes)
    request = Request(own, job_options, moving, prescribed)
    return request, Finish(request, out, full, lambda points: adapter.write(mesh, points), adapter)
