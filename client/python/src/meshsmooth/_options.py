"""Methods and options, as callers write them, to the messages of the wire.

What is unset stays unset: the server's default holds, which `Client.info()` and the summary report.
"""

from __future__ import annotations

import contextlib
import datetime
import operator
import re
import typing
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any, cast

import numpy as np
from google.protobuf import descriptor, duration_pb2

from . import _methods
from ._errors import Error, InvalidOption, misplaced, out_of_range
from ._job_options import (
    MOVE_OPTIONS,
    OPTIONS,
    Duration,
    JobOptions,
    choices_of,
)
from ._methods import NAMED_METHODS, WIRE_NAMES, Method, Move, Optimize
from .v1 import smoothing_pb2 as pb


def to_choice(name: str, value: Any, choices: Sequence[str], enum: Any) -> int:
    """Returns the number of an enumerator by the command line's name.

    Args:
        name: of the option.
        value: that it was given.
        choices: that it has.
        enum: the enumeration's descriptor.
    """
    prefix = enum.values[0].name.removesuffix("UNSPECIFIED")
    if isinstance(value, str):
        written = value.lower().replace("-", "_")
        if written in [choice.replace("-", "_") for choice in choices]:
            found = enum.values_by_name.get(prefix + written.upper())
            return 0 if found is None else int(found.number)  # "auto" is what is unset
    raise out_of_range(name, f"{name} is {value!r}, it must be one of {', '.join(choices)}")


def to_metrics(chosen: Any) -> list[int]:
    """Returns the numbers of the metrics that `element_quality` names."""
    if chosen is None:
        return []
    names = [chosen] if isinstance(chosen, str) else chosen
    choices = choices_of(OPTIONS["element_quality"][0])
    return [
        to_choice("element_quality", name, choices, pb.QualityMetric.DESCRIPTOR) for name in names
    ]


_SECONDS = {"ms": 1e-3, "s": 1, "min": 60, "h": 3600, "d": 86400}


def to_seconds(field: str, value: Duration) -> float:
    """Returns a duration in seconds; it must be above 0."""
    seconds: float | None = None
    if isinstance(value, datetime.timedelta):
        seconds = value.total_seconds()
    elif isinstance(value, str):
        match = re.fullmatch(r"\s*([\d.]+(?:e[+-]?\d+)?)\s*(ms|s|min|h|d)\s*", value)
        if match:
            seconds = float(match[1]) * _SECONDS[match[2]]
    elif not isinstance(value, bool):
        with contextlib.suppress(TypeError, ValueError):
            seconds = float(value)
    if seconds is None or not seconds > 0:
        raise out_of_range(
            field, f'{field} is {value!r}, it must be above 0 seconds, or as "10min" and "500ms"'
        )
    return seconds


def to_duration(field: str, value: Duration) -> duration_pb2.Duration:
    """The same as a message."""
    whole = min(to_seconds(field, value), 1e10)
    return duration_pb2.Duration(seconds=int(whole), nanos=int(whole % 1 * 1e9))


def to_method(options: JobOptions) -> Method | None:
    """Returns the method of a job; None: the server's default, which is optimize."""
    method = options.get("method")
    if isinstance(method, str):
        name = method.replace("_", "-")
        if name not in NAMED_METHODS:
            raise out_of_range(
                "method", f"method is {method!r}, it must be one of {', '.join(NAMED_METHODS)}"
            )
        method = NAMED_METHODS[name]
    elif method is not None and not isinstance(method, Method):
        raise out_of_range("method", f"method is {method!r}, it must be a name or ms.Optimize(…)")
    short: dict[str, Any] = {
        field.name: options[field.name]  # type: ignore[literal-required]
        for field in fields(Optimize)
        if options.get(field.name) is not None
    }
    if not short:
        # Servers know this option of a method that is named only.
        if method is None and options.get("target_quality") is not None:
            return Optimize()
        return method
    plain = Optimize() if method is None else method
    if plain != type(plain)() or not all(hasattr(plain, name) for name in short):
        name = next(iter(short))
        owner = type(plain).__name__ if hasattr(plain, name) else "Optimize"
        raise misplaced(name, f"{name} is a field of ms.{owner}; with ms.{owner}(…) it goes there")
    return replace(plain, **short)


_MOTION = MOVE_OPTIONS.keys() - OPTIONS.keys()


def to_move_options(options: JobOptions) -> JobOptions:
    """Returns the options of `move` as those of a job: with the method, without the motion."""
    method = options.get("method") or "move"
    if method != "move" and not isinstance(method, Move):
        raise misplaced("method", f"move has the method ms.Move(…), not {method!r}")
    others = {name: value for name, value in options.items() if name not in _MOTION}
    return cast("JobOptions", others | {"method": method})


def default_iterations(options: JobOptions) -> int:
    """Returns how many iterations a job may take, as far as the client can tell."""
    iterations = options.get("iterations")
    if iterations is not None:
        return max(iterations, 0)
    return (to_method(options) or Optimize())._iterations


def slide_on_surface(options: JobOptions) -> JobOptions:
    """Returns the options with the boundary policy that a target surface needs."""
    if options.get("surface") is None:
        return options
    boundary = options.get("boundary") or "slide"
    if boundary != "slide":
        raise misplaced(
            "surface", f'boundary nodes slide on a surface, but there is boundary="{boundary}"'
        )
    return cast("JobOptions", options | {"boundary": "slide"})


def encode_options(options: JobOptions) -> pb.SmoothingOptions:
    """Returns the options of a job as they travel."""
    message = pb.SmoothingOptions()
    method = to_method(options)
    if method is not None:
        _encode_method(method, message)
    if options.get("reference") is not None:
        _aim_at_reference(method, message)
    elif isinstance(method, Optimize) and method.target == "reference":
        raise misplaced("reference", 'target="reference" needs reference=…')
    if options.get("surface") is not None and not isinstance(method, Optimize | None):
        raise misplaced("surface", 'surface belongs to method="optimize"')
    _encode_fields(options, message, "")
    _encode_movement_limit(options.get("movement_limit"), message)
    return message


def encode_job(options: JobOptions, spec: pb.JobSpec) -> None:
    """Writes the options that concern the job, not the mesh, to its spec."""
    _encode_fields(options, spec, "spec.")


def _encode_fields(options: JobOptions, message: Any, of: str) -> None:
    """Writes all options with a field of this message."""
    fields_of_message = _FIELDS[of]
    for name, value in options.items():
        if value is not None and name in fields_of_message:
            field, choices = fields_of_message[name]
            _set(message, field, name, value, choices)


def _fields_of(of: str) -> dict[str, tuple[str, tuple[str, ...]]]:
    """Field and choices of the options that a message has, by their names."""
    found = {}
    for name, (kind, option) in OPTIONS.items():
        owner, dot, field = option.field.rpartition(".")
        if field and owner + dot == of:
            found[name] = field, choices_of(kind)
    return found


_FIELDS = {of: _fields_of(of) for of in ("", "spec.")}


def _encode_method(method: Method, message: pb.SmoothingOptions) -> None:
    own = getattr(message, method._name)
    own.SetInParent()
    hints = typing.get_type_hints(type(method), vars(_methods))
    for field in fields(method):
        value = getattr(method, field.name)
        if value is not None:
            name = WIRE_NAMES.get(field.name, field.name)
            _set(own, name, field.name, value, choices_of(hints[field.name]))


def _set(message: Any, field: str, name: str, value: Any, choices: Sequence[str]) -> None:
    """Sets a field to the value of an option, whose type is the field's."""
    descriptor = message.DESCRIPTOR.fields_by_name[field]
    if descriptor.enum_type is not None:
        setattr(message, field, to_choice(name, value, choices, descriptor.enum_type))
    elif descriptor.message_type is not None:
        getattr(message, field).CopyFrom(to_duration(name, value))
    else:
        try:
            setattr(message, field, _PLAIN[descriptor.cpp_type](value))
        except (TypeError, ValueError, OverflowError):
            raise out_of_range(
                name, f"{name} is {value!r}, it must be {_NOUNS[descriptor.cpp_type]}"
            ) from None


def _to_bool(value: Any) -> bool:
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise TypeError


def _to_int(value: Any) -> int:
    if isinstance(value, bool | np.bool_):
        raise TypeError
    return operator.index(value)


def _to_float(value: Any) -> float:
    if isinstance(value, bool | np.bool_ | str | bytes):
        raise TypeError
    return float(value)


_CPP = descriptor.FieldDescriptor
_PLAIN: dict[int, Callable[[Any], Any]] = {
    _CPP.CPPTYPE_BOOL: _to_bool,
    _CPP.CPPTYPE_INT32: _to_int,
    _CPP.CPPTYPE_DOUBLE: _to_float,
}
_NOUNS = {
    _CPP.CPPTYPE_BOOL: "True or False",
    _CPP.CPPTYPE_INT32: "a whole number of 32 bits",
    _CPP.CPPTYPE_DOUBLE: "a number",
}


def name_option(error: Error) -> None:
    """Has the error of an option say the keyword that the caller wrote."""
    field = error.details.get("field", "")
    own = field.rpartition(".")[2]
    # A parameter of a method, as in "optimize.stay", is a keyword or a field of the same name.
    name = _KEYWORDS.get(own, own if isinstance(error, InvalidOption) else field)
    if name != field:
        error.message = error.message.replace(field, name).replace(own, name)


_KEYWORDS = {
    "absolute_movement_limit": "movement_limit",
    **{wire: name.rstrip("_") for name, wire in WIRE_NAMES.items()},
    **{option.field: name for name, (_, option) in OPTIONS.items() if option.field},
}


def _aim_at_reference(method: Method | None, message: pb.SmoothingOptions) -> None:
    if not isinstance(method, Optimize | None) or (
        method is not None and method.target in ("ideal", "input")
    ):
        raise misplaced(
            "reference", 'reference belongs to method="optimize" with target="reference"'
        )
    message.optimize.target = pb.TARGET_REFERENCE


def _encode_movement_limit(limit: float | str | None, message: pb.SmoothingOptions) -> None:
    if limit is None:
        return
    try:
        if isinstance(limit, str) and limit.rstrip().endswith("%"):
            message.movement_limit = float(limit.rstrip()[:-1]) / 100
        else:
            message.absolute_movement_limit = float(limit)
    except ValueError:
        raise out_of_range(
            "movement_limit",
            f"movement_limit {limit!r} is neither a length (0.5) nor a share of the diagonal "
            '("2%")',
        ) from None
