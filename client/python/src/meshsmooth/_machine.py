"""Calls without input and output, as state machines that any connection drives.

A call is a generator: it yields an action, which a connection performs, and gets what came of it.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, Generic, NamedTuple, TypeVar, cast

from ._rpc import Unary
from ._service_error import Status
from ._wire import Upload

R = TypeVar("R")


class Ask(NamedTuple):
    """Sends a message; what comes of it is the answer or a `Failed`."""

    method: Unary[Any]
    request: Any
    timeout: float  # seconds


class Begin(NamedTuple):
    """Begins a call whose answers are a stream, in place of an earlier one; nothing comes of it.

    Attributes:
        path: of the method.
        first: its first message.
        upload: the messages that follow; None: the first is the only one.
        timeout: in seconds.
        metadata: beside the token's.
    """

    path: str
    first: bytes
    upload: Upload | None
    timeout: float
    metadata: list[tuple[str, str]]


class Receive(NamedTuple):
    """Takes the next answer; what comes of it are its bytes, None at the end, or a `Failed`."""


class Wait(NamedTuple):
    """Waits, at most until the caller cancels; nothing comes of it."""

    seconds: float


class Failed(NamedTuple):
    """The end of a call with a status other than OK, and the address of its server."""

    status: Status
    server: str


RECEIVE = Receive()

Action = Ask | Begin | Receive | Wait
Steps = Generator[Action, Any, R]


class Machine(Generic[R]):
    """A call under way.

    Attributes:
        action: what is to be done next; None: the call has ended.
    """

    def __init__(self, steps: Steps[R]) -> None:
        """Makes the first step; raises what it raises."""
        self._steps = steps
        self._result: R | None = None
        self.action: Action | None = None
        self.feed(None)

    def feed(self, event: Any) -> None:
        """Takes what came of the action; raises the error that the call ends with."""
        try:
            self.action = self._steps.send(event)
        except StopIteration as end:
            self.action, self._result = None, end.value

    def fail(self, error: BaseException) -> None:
        """Takes what the action raised; raises the error that the call ends with."""
        try:
            self.action = self._steps.throw(error)
        except StopIteration as end:
            self.action, self._result = None, end.value

    @property
    def result(self) -> R:
        """What the call returns, once it has ended."""
        return cast("R", self._result)
