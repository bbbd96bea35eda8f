"""Improves finite-element meshes: nodes move, nothing else changes, valid stays valid.

    import meshsmooth as ms
    better = ms.smooth(grid)  # PyVista, VTK, meshio, trimesh, scikit-fem, (points, cells)

The guide is docs/python.md.
"""

from ._adapters import register_adapter
from ._channel import Tls
from ._client import Client, Session
from ._default import default_client, quality, smooth
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
from ._mesh import MeshData
from ._options import (
    HcLaplacian,
    JobOptions,
    Laplacian,
    Optimize,
    SmartLaplacian,
    Taubin,
    WindowedSinc,
)
from ._progress import Progress
from ._result import SmoothResult
from ._rpc import JobInfo, ServerInfo, TopologyInfo
from ._summary import ElementQuality, MetricStats, QualityStats, Summary

__all__ = [
    "AccessDenied",
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
    "MeshData",
    "MetricStats",
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
    "WindowedSinc",
    "default_client",
    "quality",
    "register_adapter",
    "smooth",
]
