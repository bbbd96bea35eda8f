"""What calls raise.

Every error is an `Error` and, where Python has a builtin for it, that too: an invalid mesh is a
`ValueError`, a server that cannot be reached a `ConnectionError`, a deadline a `TimeoutError`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

SERVER_ENDED = "SERVER_ENDED"  # the reason of calls to a local server that has ended by itself
FORKED = "FORKED"  # the reason of calls in a process that was forked after its parent's first


class Error(Exception):
    """A failed call.

    `str()` is what failed, where, and what to do, on one line.

    Attributes:
        message: what failed, without reason and hint.
        reason: the stable name of docs/protocol.md, as in "INDEX_OUT_OF_RANGE"; "" if the error was
            not made by meshsmooth.
        code: the gRPC status as in "INVALID_ARGUMENT"; "" if there was no call.
        details: the facts of the reason by name, as the server numbers elements and nodes.
        hint: what to do; may be empty.
    """

    def __init__(
        self,
        message: str,
        *,
        reason: str = "",
        code: str = "",
        details: Mapping[str, str] | None = None,
        hint: str = "",
        retry_delay: float | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.reason = reason
        self.code = code
        self.details = dict(details or {})
        self.hint = hint
        # Seconds after which the same request may succeed; None: it will not.
        self._retry_delay = retry_delay

    def __str__(self) -> str:
        text = self.message
        if self.reason:
            text += f" ({self.reason})"
        if self.hint:
            text += f"; {self.hint}"
        return text.replace("\r", " ").replace("\n", " ")


class InvalidMesh(Error, ValueError):
    """The mesh cannot be smoothed.

    Attributes:
        element: the first element that is wrong, in the caller's numbering (docs/python.md); None
            if the reason has none.
        node: the first node that is wrong, likewise.
    """

    # Of instances, not of the class: ray's errors derive from this class too, and ask the one that
    # they carry for what they do not find.
    element: int | None
    node: int | None

    def __init__(self, message: str, **facts: Any) -> None:
        super().__init__(message, **facts)
        self.element = None
        self.node = None


class InvalidOption(Error, ValueError):
    """An option is out of range, unknown, or means nothing in its context."""


class Busy(Error):
    """The server has no room now."""

    @property
    def retry_after(self) -> float:
        """Seconds after which the same call may succeed."""
        return self._retry_delay or 0.0


class TooLarge(Error):
    """The job never fits this server.

    Attributes:
        need_bytes: memory that the job needs.
        limit_bytes: memory that it may have.
        space: "host" or "device".
    """

    need_bytes: int | None
    limit_bytes: int | None
    space: str

    def __init__(self, message: str, **facts: Any) -> None:
        super().__init__(message, **facts)
        self.need_bytes = None
        self.limit_bytes = None
        self.space = ""


class Unavailable(Error, ConnectionError):
    """No server answers, it is shutting down, or the connection to it broke."""


class AccessDenied(Error, PermissionError):
    """The server asks for another token or certificate."""


class NotFound(Error, LookupError):
    """The server has no job, result or topology of this name for this caller."""


class DeadlineExceeded(Error, TimeoutError):
    """The call or its queue timeout took too long."""


class Cancelled(Error):
    """The job was cancelled, by this caller or by another call."""


class ServerError(Error):
    """The server failed, or something between here and the server.

    Attributes:
        incident: the id under which the server's log has the failure; "" if there is none.
    """

    incident: str

    def __init__(self, message: str, **facts: Any) -> None:
        super().__init__(message, **facts)
        self.incident = ""


def out_of_range(field: str, what: str) -> InvalidOption:
    """Returns the error of an option with a value that it cannot have."""
    return InvalidOption(what, reason="OPTION_OUT_OF_RANGE", details={"field": field})


def misplaced(field: str, what: str) -> InvalidOption:
    """Returns the error of an option that means nothing where it is."""
    return InvalidOption(what, reason="OPTION_MISPLACED", details={"field": field})


def is_of_one_mesh(error: Exception) -> bool:
    """Returns whether other meshes may fare better than the one of this error."""
    if isinstance(error, Unavailable | AccessDenied) or not isinstance(error, Error):
        return False
    return error.reason != FORKED
