"""Improves finite-element meshes: nodes move, nothing else changes, valid stays valid.

    import meshsmooth as ms
    better = ms.smooth(grid)  # PyVista, VTK, meshio, trimesh, scikit-fem, (points, cells)

`help(ms.smooth)` lists the options. The guide is docs/python.md of the sources.
"""

import sys
from typing import TYPE_CHECKING

from . import _report, _report_html, gmsh  # noqa: F401, the reports register themselves
from ._adapters import register_adapter
from ._aio import AsyncClient
from ._aio_job import AsyncJob, AsyncSession
from ._client import Client
from ._credentials import Tls
from ._default import default_client, move, quality, smooth, smooth_many
from ._errors import (
    AccessDenied,
    Busy,
    Cancelled,
    DeadlineExceeded,
    Error,
    InvalidMesh,
    InvalidOption,
    NotFound,
    ServerError,
    TooLarge,
    Unavailable,
)
from ._job import Job
from ._job_options import JobOptions, MoveOptions
from ._mesh import MeshData
from ._methods import (
    HcLaplacian,
    Laplacian,
    Move,
    Optimize,
    SmartLaplacian,
    Taubin,
    WindowedSinc,
)
from ._plot import plot_quality
from ._progress import Progress
from ._result import SmoothResult
from ._rpc import JobInfo, ServerInfo, TopologyInfo
from ._session import Session
from ._summary import ElementQuality, MetricStats, QualityStats, Summary
from ._why import Why, why

__all__ = [
    "AccessDenied",
    "AsyncClient",
    "AsyncJob",
    "AsyncSession",
    "Busy",
    "Cancelled",
    "Client",
    "DeadlineExceeded",
    "ElementQuality",
    "Error",
    "HcLaplacian",
    "InvalidMesh",
    "InvalidOption",
    "Job",
    "JobInfo",
    "JobOptions",
    "Laplacian",
    "LocalServer",
    "MeshData",
    "MetricStats",
    "Move",
    "MoveOptions",
    "NotFound",
    "Optimize",
    "Progress",
    "QualityStats",
    "ServerError",
    "ServerInfo",
    "Session",
    "SmartLaplacian",
    "SmoothResult",
    "Summary",
    "Taubin",
    "Tls",
    "TooLarge",
    "TopologyInfo",
    "Unavailable",
    "Why",
    "WindowedSinc",
    "default_client",
    "gmsh",
    "move",
    "plot_quality",
    "quality",
    "register_adapter",
    "smooth",
    "smooth_many",
    "why",
]

for _name in __all__:  # as callers write them, in tracebacks and in help
    if getattr(globals().get(_name), "__module__", "").startswith(f"{__name__}."):
        globals()[_name].__module__ = __name__

if TYPE_CHECKING:
    from ._local import LocalServer

    __version__: str
else:  # type checkers would take any name for one of ours

    def __getattr__(name):
        """Imports what few need when they do: the local server and the version."""
        if name == "LocalServer":
            from ._local import LocalServer

            LocalServer.__module__ = __name__
            return LocalServer
        if name == "__version__":
            import importlib.metadata

            try:
                return importlib.metadata.version("meshsmooth")
            except importlib.metadata.PackageNotFoundError:
                return "unknown"  # a checkout that is not installed
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__", "__doc__", "__file__", "__name__", "__path__"]


# An installed package is found by its entry point; a checkout is not.
if hasattr(sys.modules.get("pyvista"), "register_dataset_accessor"):
    from . import _pyvista  # noqa: F401
