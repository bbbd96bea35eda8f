"""gRPC statuses to errors, with the hints that the command line gives.

Reasons and hints are declared in proto/declaration, for client/library/src/service_error.cpp too.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import grpc

from . import _errors as errors
from . import _tables
from ._foreign_status import (
    CallFacts,
    foreign_hint,
    foreign_message,
    foreign_retry_delay,
)
from ._tables import ERRORS_BY_REASON, ERRORS_BY_STATUS
from .v1 import error_details_pb2 as details_pb2


class Status(Protocol):
    """What a failed call tells of itself."""

    def code(self) -> grpc.StatusCode: ...
    def details(self) -> str | None: ...
    def trailing_metadata(self) -> Iterable[tuple[str, str | bytes]] | None: ...


@dataclass(frozen=True)
class _Details:
    reason: str
    metadata: dict[str, str]
    retry_delay: float | None


def to_error(status: Status, facts: CallFacts) -> errors.Error:
    """Returns the error of a call that ended with a status other than OK."""
    code = status.code().name
    text = status.details() or ""
    told = _decode_details(status)
    if told is None:
        return _make(
            code,
            "",
            foreign_message(code, text, facts),
            {},
            foreign_hint(code, text, facts),
            foreign_retry_delay(code, text, facts),
        )
    hint = ""
    if told.retry_delay is not None:
        hint = (
            f"try again in {told.retry_delay:.3g} s"
            if told.retry_delay > 0
            else _tables.AT_ONCE_HINT
        )
    if code == "UNAUTHENTICATED":
        hint = _tables.TOKEN_HINT
    return _make(code, told.reason, text, told.metadata, hint, told.retry_delay)


def broken_answer(what: str) -> errors.ServerError:
    """Returns the error of an answer that breaks the protocol."""
    return errors.ServerError(what, code="DATA_LOSS", hint=_tables.BROKEN_ANSWER_HINT)


def _make(
    code: str,
    reason: str,
    message: str,
    details: dict[str, str],
    hint: str,
    retry_delay: float | None,
) -> errors.Error:
    kind = ERRORS_BY_REASON.get(reason) or ERRORS_BY_STATUS.get(code, errors.Error)
    if kind is errors.Error and code == "RESOURCE_EXHAUSTED":
        kind = errors.Busy if retry_delay is not None else errors.ServerError
    error = kind(
        message, reason=reason, code=code, details=details, hint=hint, retry_delay=retry_delay
    )
    if isinstance(error, errors.TooLarge):
        error.need_bytes = _whole(details.get("need_bytes"))
        error.limit_bytes = _whole(details.get("limit_bytes"))
        error.space = details.get("space", "")
    if isinstance(error, errors.ServerError):
        error.incident = details.get("incident", "")
    return error


def _whole(text: str | None) -> int | None:
    return int(text) if text and re.fullmatch(r"\d+", text) else None


def place_in_input(
    error: errors.Error, element_count: int, node_count: int, mesh: _Numbering
) -> None:
    """Gives an invalid mesh's error the caller's numbers, in its attributes and its text."""
    if not isinstance(error, errors.InvalidMesh):
        return
    places = []
    element, node = (_whole(error.details.get(key)) for key in ("element", "node"))
    if element is not None and element < element_count:
        error.element = mesh.caller_element(element)
        if error.element != element:
            places.append(f"element {error.element}")
    if node is not None:
        error.node = mesh.caller_node(node) if node < node_count else node
        if error.node != node:
            places.append(f"node {error.node}")
    if places:
        error.message += f" (in the input: {', '.join(places)})"


class _Numbering(Protocol):
    def caller_element(self, element: int) -> int: ...
    def caller_node(self, node: int) -> int: ...


def _decode_details(status: Status) -> _Details | None:
    for key, value in status.trailing_metadata() or ():
        if key != "grpc-status-details-bin" or not isinstance(value, bytes):
            continue
        try:
            return _parse_details(value)
        except Exception:  # protobuf's DecodeError; of a proxy's making
            return None
    return None


def _parse_details(value: bytes) -> _Details | None:
    info = details_pb2.ErrorInfo()
    retry_delay = None
    for detail in details_pb2.Status.FromString(value).details:
        name = detail.type_url.rpartition("/")[2]
        if name == "google.rpc.ErrorInfo":
            info = details_pb2.ErrorInfo.FromString(detail.value)
        elif name == "google.rpc.RetryInfo":
            delay = details_pb2.RetryInfo.FromString(detail.value).retry_delay
            retry_delay = delay.seconds + delay.nanos * 1e-9
    return _Details(info.reason, dict(info.metadata), retry_delay) if info.reason else None
