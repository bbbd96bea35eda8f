"""gRPC statuses to errors, with the hints that the command line gives.

Mirrors client/library/src/service_error.cpp. The texts of gRPC and of proxies are those of gRPC 1.51 to
1.85, HAProxy 2.6 and nginx 1.22.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import grpc

from . import _errors as errors
from .v1 import error_details_pb2 as details_pb2

_UNCHANGED = "; the mesh here is unchanged"

_OPTION_REASONS = {
    "OPTION_OUT_OF_RANGE",
    "OPTION_NOT_SUPPORTED",
    "BACKEND_NOT_AVAILABLE",
    "REQUEST_ID_REUSED",
    "RESULT_OFFSET_PAST_END",
}
_MESH_REASONS = {
    "ARRAY_SIZE_MISMATCH",
    "FACET_OVERUSED",
    "INDEX_OUT_OF_RANGE",
    "MESH_EMPTY",
    "MESH_TANGLED",
    "MID_NODE_MISPLACED",
    "MIXED_DIMENSIONS",
    "MIXED_ORDERS",
    "NON_FINITE_COORDINATE",
    "PAIR_HALF_PRESCRIBED",
    "PRESCRIBED_AND_FIXED",
    "PRESCRIBED_TWICE",
    "REFERENCE_DIFFERS",
    "REFERENCE_FLAT",
    "REFERENCE_TANGLED",
    "REPEATED_NODE",
}
_TYPES: dict[str, type[errors.Error]] = {
    "UNAVAILABLE": errors.Unavailable,
    "UNAUTHENTICATED": errors.AccessDenied,
    "PERMISSION_DENIED": errors.AccessDenied,
    "NOT_FOUND": errors.NotFound,
    "DEADLINE_EXCEEDED": errors.DeadlineExceeded,
    "CANCELLED": errors.Cancelled,
    "INTERNAL": errors.ServerError,
    "DATA_LOSS": errors.ServerError,
    "UNKNOWN": errors.ServerError,
    "UNIMPLEMENTED": errors.ServerError,
}


@dataclass(frozen=True)
class CallFacts:
    """What is known of a call that failed."""

    server: str  # as the user named it
    timeout: float  # seconds
    cancelled_by_caller: bool = False
    answered: bool = True  # the server accepted the job


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
            _foreign_message(code, text, facts),
            {},
            _foreign_hint(code, text, facts),
            _foreign_retry_delay(code, text, facts),
        )
    hint = ""
    if told.retry_delay is not None:
        hint = (
            f"try again in {told.retry_delay:.3g} s"
            if told.retry_delay > 0
            else "try again at once, or elsewhere"
        )
    if code == "UNAUTHENTICATED":
        hint = "set Client(token=…)"
    return _make(code, told.reason, text, told.metadata, hint, told.retry_delay)


def broken_answer(what: str) -> errors.ServerError:
    """Returns the error of an answer that breaks the protocol."""
    return errors.ServerError(
        what,
        code="DATA_LOSS",
        hint="server and client are incompatible, or a proxy between them truncates responses"
        + _UNCHANGED,
    )


def _make(
    code: str,
    reason: str,
    message: str,
    details: dict[str, str],
    hint: str,
    retry_delay: float | None,
) -> errors.Error:
    kind = _TYPES.get(code, errors.Error)
    if reason in _MESH_REASONS:
        kind = errors.InvalidMesh
    elif reason in _OPTION_REASONS:
        kind = errors.InvalidOption
    elif reason == "MESH_TOO_LARGE":
        kind = errors.TooLarge
    elif code == "RESOURCE_EXHAUSTED":
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


def _has(text: str, *words: str) -> bool:
    return any(word in text for word in words)


def _was_reset(text: str, code: int) -> bool:
    return "RST_STREAM" in text and text.endswith(f"error code {code}")


def _never_connected(text: str) -> bool:
    return _has(
        text,
        "failed to connect",
        "onnection refused",
        "resolution failed",
        "empty address list",
        "o such file or directory",
        "errors resolving",
        "DNS resolution",
    )


def _name_unknown(text: str) -> bool:
    return _has(text, "omain name not found", "isformatted domain name", "or service not known")


def _broken_off(code: str, text: str) -> bool:
    """Whether a proxy's or a dying server's status hides that the connection broke.

    HAProxy 2.6 ends the stream without a status, or resets it; a meshsmooth server that cancels a
    job says why.
    """
    return (code == "UNKNOWN" and text == "Stream removed") or code == "CANCELLED"


def _foreign_retry_delay(code: str, text: str, facts: CallFacts) -> float | None:
    """A connection that broke may come back; an address where nobody answers does not."""
    broke = code == "UNAVAILABLE" and not _never_connected(text)
    if not broke and (facts.cancelled_by_caller or not _broken_off(code, text)):
        return None
    return 0.1


def _foreign_message(code: str, text: str, facts: CallFacts) -> str:
    if code == "DEADLINE_EXCEEDED":
        return f"the call did not end within its {facts.timeout:.3g} s"
    if facts.cancelled_by_caller:
        return "cancelled"
    return f"{facts.server}: {text or 'the call failed without a message'}"


def _foreign_hint(code: str, text: str, facts: CallFacts) -> str:
    if code == "UNAVAILABLE":
        return _unavailable_hint(text, facts.server)
    if code == "DEADLINE_EXCEEDED":
        if not facts.answered:
            return (
                "no response received; a proxy may be buffering the request "
                "(nginx: grpc_pass, not proxy_pass)" + _UNCHANGED
            )
        return (
            "allow more time, or set compute_budget to get the best result reached in it"
            + _UNCHANGED
        )
    if code == "CANCELLED" or (code == "UNKNOWN" and "Stream removed" in text):
        return "" if facts.cancelled_by_caller else _proxy_ended_hint()
    if code == "INTERNAL":
        return _internal_hint(text)
    if code == "UNIMPLEMENTED":
        return (
            f"what answers at {facts.server} is not a meshsmooth server, or is too old for "
            "this call"
        )
    return ""


def _proxy_ended_hint() -> str:
    return (
        "neither side cancelled: a proxy or the server ended the call (HAProxy: timeout client, "
        "timeout server, or the server behind it is gone)" + _UNCHANGED
    )


def _internal_hint(text: str) -> str:
    if _was_reset(text, 0):
        return "a proxy cut the upload: lift its body limit (nginx: client_max_body_size 0)"
    if _was_reset(text, 1):
        return (
            "a proxy gave up waiting: raise its timeouts (nginx: grpc_read_timeout, "
            "client_body_timeout)"
        )
    if _was_reset(text, 2):
        return (
            "a proxy ended the call: lift its body limit (nginx: client_max_body_size 0) and raise "
            "its timeouts (nginx: grpc_read_timeout, client_body_timeout), unless the server "
            "behind it is gone" + _UNCHANGED
        )
    return "something between here and the server failed" + _UNCHANGED


def _unavailable_hint(text: str, server: str) -> str:
    # HAProxy 2.6 answers 502 or, while the request still comes in, REFUSED_STREAM (RFC 9113, §7).
    if _was_reset(text, 7) or _has(
        text, "http2 header with status: 50", "no server behind this proxy"
    ):
        return (
            f"a proxy answers at {server}, but no server behind it does, or the two do not speak "
            "HTTP/2 to each other"
        )
    if "http1.x server" in text:
        return (
            f"the peer at {server} does not speak HTTP/2; if it is a proxy, enable HTTP/2 (nginx: "
            "listen … http2; HAProxy: proto h2, or alpn h2 with TLS)"
        )
    if hint := _tls_hint(text, server):
        return hint
    if _name_unknown(text):
        return "the name is not known; an address is HOST:PORT, unix:PATH or dns:///NAME:PORT"
    if _never_connected(text):
        return (
            "no server answers there; check the address, or start one with: "
            f"meshsmooth-server --listen {server}"
        )
    return (
        f"the connection to {server} broke while the job was under way: the server ended or the "
        f"network failed{_UNCHANGED}, send it again"
    )


def _tls_hint(text: str, server: str) -> str:
    """Why no secure connection was established; empty when TLS is not to blame."""
    if _has(text, "certificate verify failed", "CERTIFICATE_VERIFY_FAILED"):
        return (
            f"the certificate of {server} is expired or not signed by an authority that this "
            "client trusts; set Tls(ca=…)"
        )
    if "is not in peer certificate" in text:
        return (
            "the certificate is for another name; if that is the intended server, set "
            "Tls(server_name=…)"
        )
    if _has(text, "wrong version number", "WRONG_VERSION_NUMBER"):
        return f"the server at {server} runs without TLS; leave tls unset"
    if _never_connected(text) and _has(text, "Socket closed", "onnection reset"):
        return (
            "the server closed the connection before the call: it may require TLS (Tls(ca=…)) or "
            "a valid client certificate that it trusts (Tls(cert=…, key=…))"
        )
    if "empty address list" in text:
        return (
            "the files of Tls(cert=…, key=…) cannot be used: check that they are PEM and belong "
            "together"
        )
    return ""
