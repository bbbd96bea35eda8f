"""Error reasons and failures of calls.

Made by scripts/tables from proto/declaration; do not edit.
"""
# fmt: off
# ruff: noqa: E501

from __future__ import annotations

from typing import NamedTuple

from . import _errors as errors


class Failure(NamedTuple):
    """Calls that fail without a reason, by what is seen of them."""

    statuses: tuple[str, ...]
    condition: str  # "", "never_connected", "unanswered" or "cancelled"
    reset: int  # error code of an RST_STREAM; -1: any text
    texts: tuple[str, ...]
    hint: str


ERRORS_BY_REASON: dict[str, type[errors.Error]] = {
    "OPTION_OUT_OF_RANGE": errors.InvalidOption,
    "OPTION_NOT_SUPPORTED": errors.InvalidOption,
    "MESH_EMPTY": errors.InvalidMesh,
    "MIXED_DIMENSIONS": errors.InvalidMesh,
    "MIXED_ORDERS": errors.InvalidMesh,
    "MID_NODE_MISPLACED": errors.InvalidMesh,
    "ARRAY_SIZE_MISMATCH": errors.InvalidMesh,
    "INDEX_OUT_OF_RANGE": errors.InvalidMesh,
    "REPEATED_NODE": errors.InvalidMesh,
    "REFERENCE_FLAT": errors.InvalidMesh,
    "REFERENCE_TANGLED": errors.InvalidMesh,
    "PRESCRIBED_TWICE": errors.InvalidMesh,
    "PRESCRIBED_AND_FIXED": errors.InvalidMesh,
    "PAIR_HALF_PRESCRIBED": errors.InvalidMesh,
    "NON_FINITE_COORDINATE": errors.InvalidMesh,
    "SURFACE_INVALID": errors.InvalidMesh,
    "FACET_OVERUSED": errors.InvalidMesh,
    "MESH_TANGLED": errors.InvalidMesh,
    "BACKEND_NOT_AVAILABLE": errors.InvalidOption,
    "REQUEST_ID_REUSED": errors.InvalidOption,
    "RESULT_OFFSET_PAST_END": errors.InvalidOption,
    "MESH_TOO_LARGE": errors.TooLarge,
    "REFERENCE_DIFFERS": errors.InvalidMesh,
    "ELEMENT_NOT_SUPPORTED": errors.InvalidMesh,
    "FORMAT_ERROR": errors.InvalidMesh,
    "FILE_TRUNCATED": errors.InvalidMesh,
    "REFERENCE_REFUSED": errors.InvalidMesh,
}
ERRORS_BY_STATUS: dict[str, type[errors.Error]] = {
    "CANCELLED": errors.Cancelled,
    "UNKNOWN": errors.ServerError,
    "DEADLINE_EXCEEDED": errors.DeadlineExceeded,
    "NOT_FOUND": errors.NotFound,
    "PERMISSION_DENIED": errors.AccessDenied,
    "UNIMPLEMENTED": errors.ServerError,
    "INTERNAL": errors.ServerError,
    "UNAVAILABLE": errors.Unavailable,
    "DATA_LOSS": errors.ServerError,
    "UNAUTHENTICATED": errors.AccessDenied,
}
NEVER_CONNECTED = (
    "failed to connect",
    "onnection refused",
    "resolution failed",
    "empty address list",
    "o such file or directory",
    "errors resolving",
    "DNS resolution",
)
FAILURES = (
    Failure(("UNAVAILABLE",), "", 7, ("http2 header with status: 50", "no server behind this proxy",), "a proxy answers at {server}, but no server behind it does, or the two do not speak HTTP/2 to each other"),
    Failure(("UNAVAILABLE",), "", -1, ("http1.x server",), "the peer at {server} does not speak HTTP/2; if it is a proxy, enable HTTP/2 (nginx: listen … http2; HAProxy: proto h2, or alpn h2 with TLS)"),
    Failure(("UNAVAILABLE",), "", -1, ("certificate verify failed", "CERTIFICATE_VERIFY_FAILED",), "the certificate of {server} is expired or not signed by an authority that this client trusts; set Tls(ca=…)"),
    Failure(("UNAVAILABLE",), "", -1, ("is not in peer certificate",), "the certificate is for another name; if that is the intended server, set Tls(server_name=…)"),
    Failure(("UNAVAILABLE",), "", -1, ("wrong version number", "WRONG_VERSION_NUMBER",), "the server at {server} runs without TLS; leave tls unset"),
    Failure(("UNAVAILABLE",), "never_connected", -1, ("Socket closed", "onnection reset",), "the server closed the connection before the call: it may require TLS (Tls(ca=…)) or a valid client certificate that it trusts (Tls(cert=…, key=…))"),
    Failure(("UNAVAILABLE",), "", -1, ("empty address list",), "the files of Tls(cert=…, key=…) cannot be used: check that they are PEM and belong together"),
    Failure(("UNAVAILABLE",), "", -1, ("omain name not found", "isformatted domain name", "or service not known",), "the name is not known; an address is HOST:PORT, unix:PATH or dns:///NAME:PORT"),
    Failure(("UNAVAILABLE",), "never_connected", -1, (), "no server answers there; check the address, or start one with: meshsmooth-server --listen {server}"),
    Failure(("UNAVAILABLE",), "", -1, (), "the connection to {server} broke while the job was under way: the server ended or the network failed; the mesh here is unchanged, send it again"),
    Failure(("DEADLINE_EXCEEDED",), "unanswered", -1, (), "no response received; a proxy may be buffering the request (nginx: grpc_pass, not proxy_pass); the mesh here is unchanged"),
    Failure(("DEADLINE_EXCEEDED",), "", -1, (), "allow more time, or set compute_budget to get the best result reached in it; the mesh here is unchanged"),
    Failure(("CANCELLED", "UNKNOWN",), "cancelled", -1, (), ""),
    Failure(("UNKNOWN",), "", -1, ("Stream removed",), "neither side cancelled: a proxy or the server ended the call (HAProxy: timeout client, timeout server, or the server behind it is gone); the mesh here is unchanged"),
    Failure(("CANCELLED",), "", -1, (), "neither side cancelled: a proxy or the server ended the call (HAProxy: timeout client, timeout server, or the server behind it is gone); the mesh here is unchanged"),
    Failure(("INTERNAL",), "", 0, (), "a proxy cut the upload: lift its body limit (nginx: client_max_body_size 0)"),
    Failure(("INTERNAL",), "", 1, (), "a proxy gave up waiting: raise its timeouts (nginx: grpc_read_timeout, client_body_timeout)"),
    Failure(("INTERNAL",), "", 2, (), "a proxy ended the call: lift its body limit (nginx: client_max_body_size 0) and raise its timeouts (nginx: grpc_read_timeout, client_body_timeout), unless the server behind it is gone; the mesh here is unchanged"),
    Failure(("INTERNAL",), "", -1, (), "something between here and the server failed; the mesh here is unchanged"),
    Failure(("UNIMPLEMENTED",), "", -1, (), "what answers at {server} is not a meshsmooth server, or is too old for this call"),
)
TOKEN_HINT = "set Client(token=…)"
AT_ONCE_HINT = "try again at once, or elsewhere"
BROKEN_ANSWER_HINT = "server and client are incompatible, or a proxy between them truncates responses; the mesh here is unchanged"
