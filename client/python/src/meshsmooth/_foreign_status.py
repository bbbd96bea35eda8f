"""gRPC statuses that gRPC itself or a proxy made, with the hints that the command line gives.

The texts are those of gRPC 1.51 to 1.85, HAProxy 2.6 and nginx 1.22.
"""

from __future__ import annotations

from dataclasses import dataclass

UNCHANGED = "; the mesh here is unchanged"


@dataclass(frozen=True)
class CallFacts:
    """What is known of a call that failed."""

    server: str  # as the user named it
    timeout: float  # seconds
    cancelled_by_caller: bool = False
    answered: bool = True  # the server accepted the job


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


def foreign_retry_delay(code: str, text: str, facts: CallFacts) -> float | None:
    """Returns the seconds after which the same request may succeed; None: it will not.

    A connection that broke may come back; an address where nobody answers does not.
    """
    broke = code == "UNAVAILABLE" and not _never_connected(text)
    if not broke and (facts.cancelled_by_caller or not _broken_off(code, text)):
        return None
    return 0.1


def foreign_message(code: str, text: str, facts: CallFacts) -> str:
    """Returns what failed."""
    if code == "DEADLINE_EXCEEDED":
        return f"the call did not end within its {facts.timeout:.3g} s"
    if facts.cancelled_by_caller:
        return "cancelled"
    return f"{facts.server}: {text or 'the call failed without a message'}"


def foreign_hint(code: str, text: str, facts: CallFacts) -> str:
    """Returns what to do; "" if nothing is known."""
    if code == "UNAVAILABLE":
        return _unavailable_hint(text, facts.server)
    if code == "DEADLINE_EXCEEDED":
        if not facts.answered:
            return (
                "no response received; a proxy may be buffering the request "
                "(nginx: grpc_pass, not proxy_pass)" + UNCHANGED
            )
        return (
            "allow more time, or set compute_budget to get the best result reached in it"
            + UNCHANGED
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
        "timeout server, or the server behind it is gone)" + UNCHANGED
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
            "behind it is gone" + UNCHANGED
        )
    return "something between here and the server failed" + UNCHANGED


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
        f"network failed{UNCHANGED}, send it again"
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
