"""gRPC statuses that gRPC itself or a proxy made, with the hints that the command line gives.

Texts and hints are declared in proto/declaration, for client/library/src/service_error.cpp too.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from ._tables import FAILURES, NEVER_CONNECTED, Failure


@dataclass(frozen=True)
class CallFacts:
    """What is known of a call that failed."""

    server: str  # as the user named it
    timeout: float  # seconds
    cancelled_by_caller: bool = False
    answered: bool = True  # the server accepted the job


def _has(text: str, words: Iterable[str]) -> bool:
    return any(word in text for word in words)


def _never_connected(text: str) -> bool:
    return _has(text, NEVER_CONNECTED)


def _broken_off(code: str, text: str) -> bool:
    """Whether a proxy's or a dying server's status hides that the connection broke.

    HAProxy 2.6 ends the stream without a status, or resets it; a meshsmooth server that cancels a
    job says why.
    """
    return (code == "UNKNOWN" and text.startswith("Stream removed")) or code == "CANCELLED"


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
    """Returns what an error that no meshsmooth server sent usually means; "" if unknown."""
    conditions = {
        "": True,
        "never_connected": _never_connected(text),
        "unanswered": not facts.answered,
        "cancelled": facts.cancelled_by_caller,
    }
    for failure in FAILURES:
        if code in failure.statuses and conditions[failure.condition] and _shows(failure, text):
            return failure.hint.replace("{server}", facts.server)
    return ""


def _shows(failure: Failure, text: str) -> bool:
    """Whether the text of a call is one of a failure's."""
    if failure.reset < 0 and not failure.texts:
        return True
    # Newer gRPCs put the text in parentheses and more behind it.
    code = rf"error code {failure.reset}\b"
    was_reset = "RST_STREAM" in text and re.search(code, text) is not None
    return was_reset or _has(text, failure.texts)
