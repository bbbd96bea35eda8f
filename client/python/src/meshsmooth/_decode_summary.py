"""The summary of a job, from its message."""

from __future__ import annotations

import dataclasses
import functools
import types
import typing
from collections.abc import Callable
from typing import Any

from google.protobuf import duration_pb2, json_format

from . import _fit, _summary
from ._progress import enum_name
from ._summary import ElementQuality, Summary
from .v1 import mesh_pb2, smoothing_pb2

_ENUMS = {
    "stop_reason": (smoothing_pb2.StopReason, "STOP_REASON_"),
    "metric": (smoothing_pb2.QualityMetric, "QUALITY_METRIC_"),
    "element_type": (mesh_pb2.ElementType, "ELEMENT_TYPE_"),
    "backend_kind": (smoothing_pb2.BackendKind, "BACKEND_KIND_"),
    "state": (smoothing_pb2.State, "STATE_"),
    "end_rule": (smoothing_pb2.EndRule, "END_RULE_"),
    "priority": (smoothing_pb2.Priority, "PRIORITY_"),
    "kind": (smoothing_pb2.BackendKind, "BACKEND_KIND_"),
}


def decode_summary(message: smoothing_pb2.Summary, caller_element: Callable[[int], int]) -> Summary:
    """Returns a summary with the caller's numbers of elements."""
    summary: Summary = _decode(Summary, message, caller_element)
    return summary


@functools.cache
def _field_types(kind: type) -> dict[str, Any]:
    # Its __module__ may be the package.
    return typing.get_type_hints(kind, {**vars(_summary), **vars(_fit)})


def _decode(kind: Any, message: Any, caller_element: Callable[[int], int]) -> Any:
    """A dataclass of a message whose fields have the same names."""
    values: dict[str, Any] = {}
    for name, hint in _field_types(kind).items():
        value = getattr(message, name)
        origin = typing.get_origin(hint)
        if origin is types.UnionType:
            hint = next(option for option in typing.get_args(hint) if option is not type(None))
            if not message.HasField(name):
                values[name] = None
                continue
        if name in _ENUMS and hint is str:
            values[name] = enum_name(*_ENUMS[name], value)
        elif dataclasses.is_dataclass(hint):
            values[name] = _decode(hint, value, caller_element)
        elif name in ("blocking_elements", "mirrored_elements"):
            values[name] = tuple(map(caller_element, value))
        elif origin is tuple:
            item = typing.get_args(hint)[0]
            plain = not dataclasses.is_dataclass(item)
            values[name] = (
                tuple(value)
                if plain
                else tuple(_decode(item, entry, caller_element) for entry in value)
            )
        elif isinstance(value, duration_pb2.Duration):
            values[name] = value.seconds + value.nanos * 1e-9
        elif origin is dict:
            values[name] = json_format.MessageToDict(value, preserving_proto_field_name=True)
        elif kind is ElementQuality and name == "element":
            values[name] = caller_element(value)
        else:
            values[name] = value
    return kind(**values)
