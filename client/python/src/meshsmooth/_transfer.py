"""How the arrays of jobs travel without chunks, where they can."""

from __future__ import annotations

import abc

import numpy as np
from numpy.typing import NDArray

from . import _wire
from ._errors import Error
from .v1 import smoothing_pb2 as pb

ALIGNMENT = 64  # what an array takes at most beyond its bytes


class Transfer(abc.ABC):
    """A place that client and server both reach, for the arrays of one job after the other.

    Must be closed after a job that did not end well: the server may still write to it.
    """

    @abc.abstractmethod
    def upload(self, parts: list[_wire.Part], result_bytes: int, spec: pb.JobSpec) -> bool:
        """Copies the arrays of a job to the place, unless they lie there.

        Args:
            parts: of the arrays; those of one array follow without a gap.
            result_bytes: of the result, which gets room beside them.
            spec: gets where the arrays lie.

        Returns:
            Whether there is room, beside what is held.
        """

    @abc.abstractmethod
    def download(self) -> NDArray[np.uint8]:
        """Returns where the arrays of the result begin, once its summary is there."""

    @abc.abstractmethod
    def hold(self, size: int) -> None:
        """Has the first bytes of the result stay as they are until others are held."""

    @abc.abstractmethod
    def ended(self) -> bool:
        """Whether the place is lost, or the server asks for it."""

    @abc.abstractmethod
    def close(self) -> None:
        """Gives the place up; arrays that lie in it stay as long as somebody has them."""


class Transport(abc.ABC):
    """The transfers of one client, kept from job to job. Thread-safe."""

    @abc.abstractmethod
    def open(self, size: int) -> Transfer | None:
        """Returns one for so many bytes; None if there is none now, and has one made."""

    @abc.abstractmethod
    def give_back(self, transfer: Transfer) -> None:
        """Keeps a transfer for the next job."""

    @abc.abstractmethod
    def refused(self, error: Error) -> bool:
        """Whether the server refused the transfer, not the job."""

    @abc.abstractmethod
    def close(self) -> None:
        """Gives up all that are kept."""


class Held:
    """The transfer in whose place a session's positions lie, if they do.

    Attributes:
        transfer: None: they lie elsewhere.
    """

    def __init__(self) -> None:
        self.transfer: Transfer | None = None

    def close(self) -> None:
        """Gives it up; the positions stay as long as somebody has them."""
        if self.transfer is not None:
            self.transfer.close()
        self.transfer = None
