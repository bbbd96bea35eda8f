"""The caller's hand on a job under way."""

from __future__ import annotations

import threading
from collections.abc import Callable

from ._errors import Cancelled, Error


class Control:
    """Cancels a job, from any thread.

    Attributes:
        cancelled: whether the caller has cancelled.
        job_name: the server's name of the job, "jobs/…"; "" until it is accepted.
    """

    def __init__(self, job_name: str = "", *, kept: bool = False) -> None:
        """Controls a job; one that is `kept` outlives its calls."""
        self.cancelled = False
        self.job_name = job_name
        self._kept = kept
        self._lock = threading.Lock()
        self._interrupt: Callable[[], object] | None = None

    def cancel(self) -> None:
        """Ends the call or the wait under way, and has none follow."""
        with self._lock:
            self.cancelled = True
            interrupt = self._interrupt
        if interrupt is not None:
            interrupt()

    def arm(self, interrupt: Callable[[], object] | None) -> None:
        """Sets what `cancel` calls from now on, which is called now if the caller has cancelled."""
        with self._lock:
            self._interrupt = interrupt
            cancelled = self.cancelled
        if cancelled and interrupt is not None:
            interrupt()

    def check(self) -> None:
        """Raises `Cancelled` if the caller has cancelled."""
        if self.cancelled:
            raise Cancelled("cancelled", code="CANCELLED")

    def concerns_server(self, *, keep_result: bool) -> bool:
        """Returns whether cancelling takes a call of its own, beside the end of the job's call.

        Raises:
            Error: JOB_NOT_FOUND: there is no result to keep yet.
        """
        if keep_result and not self.job_name:
            raise Error(
                "the server has not accepted the job yet, so there is no result to keep",
                reason="JOB_NOT_FOUND",
            )
        return keep_result or (self._kept and bool(self.job_name))
