"""What an adapter between a kind of mesh and ours consists of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._mesh import MeshData

Points = NDArray[Any]


class Adapter(NamedTuple):
    """How to read a kind of mesh and how to make another of it.

    Attributes:
        read: returns the data of a mesh.
        write: returns a mesh of the same kind with positions [nodes, 2 or 3].
        annotate: adds an array of one float32 per cell to a mesh that `write` made; None: the kind
            has no cell arrays.
    """

    read: Callable[[Any], MeshData]
    write: Callable[[Any, Points], Any]
    annotate: Callable[[Any, str, NDArray[np.float32]], None] | None = None
