"""Arrays as callers have them, to NumPy's; what NumPy would misread without a word is refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import InvalidMesh


def as_array(given: Any, what: str) -> NDArray[Any]:
    """Returns an array of any library, without a copy if it can be had.

    Args:
        given: NumPy's, another library's by `__array__` or DLPack, or nested sequences.
        what: the array, for errors.

    Raises:
        InvalidMesh: ARRAY_SIZE_MISMATCH: rows differ in length, or values are masked.
    """
    if hasattr(given, "__dlpack__") and not hasattr(given, "__array__"):
        return np.asarray(np.from_dlpack(given))
    if np.ma.isMaskedArray(given) and np.ma.getmaskarray(given).any():
        row = int(np.flatnonzero(np.ma.getmaskarray(given).reshape(len(given), -1).any(axis=1))[0])
        raise _mismatch(f"row {row} of {what} is masked; a mesh has no nodes without a value")
    try:
        return np.asarray(given)
    except ValueError as error:
        raise _mismatch(f"{what} cannot be an array: {error}") from None


def as_coordinates(given: Any, what: str) -> NDArray[Any]:
    """Returns numbers that are coordinates: floats as they are, others to be converted.

    Raises:
        InvalidMesh: as `as_array`, and for complex numbers, text and objects that are no numbers.
    """
    array = as_array(given, what)
    if array.dtype.kind == "O":
        try:
            array = array.astype(np.float64)
        except (TypeError, ValueError):
            raise _mismatch(f"{what} have the type object; they must be numbers") from None
    if array.dtype.kind not in "fiu":
        raise _mismatch(f"{what} have the type {array.dtype}; they must be real numbers")
    return array


def _mismatch(text: str) -> InvalidMesh:
    return InvalidMesh(text, reason="ARRAY_SIZE_MISMATCH")


class LazyArrays(Mapping[str, NDArray[Any]]):
    """Arrays by name, each made when it is asked for."""

    def __init__(self, names: list[str], get: Callable[[str], NDArray[Any]]) -> None:
        self._names = names
        self._get = get

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._names:
            raise KeyError(name)
        return self._get(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)
