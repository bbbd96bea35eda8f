"""What is said of each option of a job, and the types that options take."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, SupportsIndex

from numpy.typing import NDArray


class SupportsArray(Protocol):
    """What NumPy makes an array of by itself: Series, tensors, masks of other packages."""

    def __array__(self) -> NDArray[Any]: ...


class SupportsDlpack(Protocol):
    """An array of another library."""

    def __dlpack__(self) -> Any: ...


Numbers = NDArray[Any] | SupportsArray | SupportsDlpack | Sequence[SupportsIndex]
Nodes = Numbers | str | Sequence[str] | None
Vectors = NDArray[Any] | SupportsArray | SupportsDlpack | Sequence[Sequence[float]]
Duration = float | str | datetime.timedelta


class Option(NamedTuple):
    """What is said of an option besides its name and type.

    Attributes:
        meaning: one line.
        default: as it is written; "" if there is none.
        unit: of a number; "" if it has none.
        takes: values in words, where the type would be a riddle; "": the type.
        field: of SmoothingOptions or, after "spec.", of JobSpec; "": encoded by itself.
        topology: a session takes it when it opens.
    """

    meaning: str
    default: str = ""
    unit: str = ""
    takes: str = ""
    field: str = ""
    topology: bool = False
