"""Checks of what callers write, before anything is made of it."""

from __future__ import annotations

import difflib
import re
from collections.abc import AsyncIterable, Iterable, Mapping
from numbers import Integral
from typing import Any

import numpy as np

from ._adapters import is_mesh
from ._errors import out_of_range
from ._job_options import OPTIONS, JobOptions
from ._options import encode_options

# As the server, and so gRPC, take it.
_TRACEPARENT = re.compile(
    r"(?!ff|00-.{52}.)[0-9a-f]{2}-(?!0{32})[0-9a-f]{32}-(?!0{16})[0-9a-f]{16}-[0-9a-f]{2}(-[!-~]{1,72})?"
)

# What other packages call ours.
_ELSEWHERE = {
    "inplace": "out",
    "max_iter": "iterations",
    "maxiter": "iterations",
    "n_iter": "iterations",
    "n_iterations": "iterations",
    "number_of_iterations": "iterations",
    "relaxation_factor": "method=ms.Laplacian(relaxation=…)",
    "tol": "tolerance",
}


def check_options(options: Mapping[str, Any], known: Mapping[str, Any] = OPTIONS) -> None:
    """Refuses keywords that are not options, and values of those that are not on the wire.

    Raises:
        TypeError: as for any other function.
        InvalidOption: OPTION_OUT_OF_RANGE.
    """
    for name in options:
        if name in known:
            continue
        near = difflib.get_close_matches(name, known, 1)
        meant = _ELSEWHERE.get(name) or next(iter(near), "")
        hint = f"did you mean {meant}{'' if '=' in meant else '='}? " if meant else ""
        raise TypeError(
            f"there is no option {name!r}; {hint}the options are {', '.join(sorted(known))}"
        )
    for name in ("merge_coincident", "file_pairs"):
        if options.get(name) is not None:
            check_bool(name, options[name])
    attempts = options.get("max_attempts")
    if attempts is not None and (isinstance(attempts, bool) or not is_whole(attempts, least=1)):
        raise out_of_range(
            "max_attempts", f"max_attempts is {attempts!r}, it must be a whole number of 1 or more"
        )
    request_id = options.get("request_id")
    if request_id is not None and not isinstance(request_id, str):
        raise out_of_range("request_id", f"request_id is {request_id!r}, it must be a UUID as text")
    traceparent = options.get("traceparent")
    if traceparent is not None and not (
        isinstance(traceparent, str) and _TRACEPARENT.fullmatch(traceparent)
    ):
        raise out_of_range(
            "traceparent",
            f"traceparent is {traceparent!r}, it must have the format of W3C Trace Context, "
            "00-<32 hex digits>-<16 hex digits>-<2 hex digits>",
        )
    progress = options.get("progress")
    if progress is not None and not callable(progress):
        check_bool("progress", progress, "True, False or a function")


def check_bool(name: str, value: Any, choices: str = "True or False") -> None:
    """Refuses what only looks like a truth value, as "no" does."""
    if not isinstance(value, bool | np.bool_):
        raise out_of_range(name, f"{name} is {value!r}, it must be {choices}")


def check_many(function: str, meshes: Any, max_in_flight: Any, options: JobOptions) -> None:
    """Refuses one mesh in place of many, no room for any, and what is wrong for every mesh.

    Raises:
        TypeError: a mesh, or what cannot be iterated over; an unknown option.
        InvalidOption: `max_in_flight` is not a whole number, or below 1; an option has no such
            value.
    """
    check_options(options)
    encode_options(options)
    # (points, cells) is one mesh; (grid, grid) are two.
    if is_mesh(meshes) and not (isinstance(meshes, tuple) and is_mesh(meshes[0])):
        raise TypeError(f"{function} takes many meshes; give one in a list, or call smooth(mesh)")
    if not isinstance(meshes, Iterable | AsyncIterable):
        raise TypeError(f"{function} takes an iterable of meshes, not {meshes!r}")
    whole = not isinstance(max_in_flight, bool) and is_whole(max_in_flight, least=1)
    if max_in_flight is not None and not whole:
        raise out_of_range(
            "max_in_flight", f"max_in_flight is {max_in_flight!r}, it must be 1 or more"
        )


def is_whole(value: Any, *, least: int) -> bool:
    """Returns whether a value is a whole number, at least so large."""
    return isinstance(value, Integral) and int(value) >= least
