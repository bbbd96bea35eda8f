"""Improves finite-element meshes: nodes move, nothing else changes, valid stays valid."""

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

__all__ = [
    "AccessDenied",
    "Busy",
    "Cancelled",
    "DeadlineExceeded",
    "Error",
    "InvalidMesh",
    "InvalidOption",
    "NotFound",
    "ServerError",
    "TooLarge",
    "Unavailable",
]
