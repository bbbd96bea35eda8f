"""When a call is tried again; mirrors client/library/src/retry.cpp."""

from __future__ import annotations

import time

from ._errors import Busy, Cancelled, DeadlineExceeded, Error, Unavailable


class Retry:
    """The attempts at one request: as many, and as long, as it allows."""

    def __init__(self, timeout: float, max_attempts: int, *, patient: bool = False) -> None:
        """Begins with the first attempt.

        Args:
            timeout: of all attempts together, in seconds.
            max_attempts: how many there may be.
            patient: a busy server is asked again until the timeout, however often.
        """
        self._deadline = time.monotonic() + timeout
        self._max_attempts = max_attempts
        self._patient = patient
        self._attempt = 0
        self._broken: Error | None = None  # what cut off an attempt that had been under way
        self._told: Error | None = None  # the last one with a reason of the server's own

    def left(self) -> float:
        """Seconds until the timeout."""
        return self._deadline - time.monotonic()

    def succeeded_in_part(self) -> None:
        """Counts anew: the last attempt got further."""
        self._attempt = 0

    def delay_after(self, error: Error) -> float:
        """Returns the seconds before the next attempt, longer each time.

        Raises:
            Error: `error`, or an earlier one that says more: there is no next attempt.
        """
        self._attempt += 1
        delay = error._retry_delay
        # A server that was there may come back, at an address where nobody answers now.
        gone = self._broken is not None and delay is None and isinstance(error, Unavailable)
        if gone:
            delay = 0.0
        if delay is not None and not error.reason and not gone:
            self._broken = error
        if error.reason:
            self._told = error
        backoff = 0.0 if self._attempt == 1 else 0.05 * (1 << min(self._attempt, 8))
        waits = max(delay or 0.0, backoff)
        used_up = self._attempt >= self._max_attempts and not (
            self._patient and isinstance(error, Busy)
        )
        if delay is not None and not used_up and waits < self.left():
            return waits
        # What happened to the job says more than that nobody answers now.
        ended_here = isinstance(error, Cancelled | DeadlineExceeded)
        if not error.reason and self._told is not None and not ended_here:
            raise self._told
        raise self._broken if gone and self._broken is not None else error
