"""The future of a job."""

from __future__ import annotations

import concurrent.futures
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from ._errors import Cancelled, Error
from ._progress import Progress

if TYPE_CHECKING:
    from ._client import Client

R = TypeVar("R")


class Control:
    """Cancels the calls of a job, from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._cancel_call: Callable[[], object] | None = None
        self.job_name = ""

    @property
    def cancelled(self) -> bool:
        """Whether the caller has cancelled."""
        return self._stop.is_set()

    def cancel(self) -> None:
        """Cancels the call under way, and those that would follow."""
        with self._lock:
            self._stop.set()
            cancel_call = self._cancel_call
        if cancel_call is not None:
            cancel_call()

    def begin(self, cancel_call: Callable[[], object]) -> None:
        """Notes how to cancel the call that begins."""
        with self._lock:
            self._cancel_call = cancel_call
            stopped = self._stop.is_set()
        if stopped:
            cancel_call()

    def end(self) -> None:
        """Notes that the call has ended."""
        with self._lock:
            self._cancel_call = None

    def wait(self, seconds: float) -> None:
        """Waits, at most until the caller cancels."""
        if seconds > 0:
            self._stop.wait(seconds)

    def check(self) -> None:
        """Raises `Cancelled` if the caller has cancelled."""
        if self.cancelled:
            raise Cancelled("cancelled", code="CANCELLED")


class Job(concurrent.futures.Future[R]):
    """A job under way; a future that `concurrent.futures.wait` and `as_completed` take too.

    Attributes:
        request_id: the UUID under which the same job can be joined.
    """

    def __init__(
        self,
        client: Client,
        request_id: str,
        control: Control,
        *,
        kept: bool,
        warn: Callable[[], None],
    ) -> None:
        super().__init__()
        self.request_id = request_id
        self._client = client
        self._control = control
        self._kept = kept
        self._warn = warn
        self._progress: Progress | None = None

    def _start(self, run: Callable[[], R]) -> None:
        self.set_running_or_notify_cancel()
        # A daemon: a job that nobody waits for must not keep the interpreter alive.
        threading.Thread(target=self._run, args=(run,), name="meshsmooth-job", daemon=True).start()

    def _run(self, run: Callable[[], R]) -> None:
        try:
            result = run()
        except BaseException as error:
            self.set_exception(error)
        else:
            self.set_result(result)

    def _note(self, progress: Progress) -> None:
        self._progress = progress

    @property
    def name(self) -> str:
        """The server's name of the job, "jobs/…"; "" until it is accepted."""
        return self._control.job_name

    @property
    def progress(self) -> Progress | None:
        """What the server last reported; None before."""
        return self._progress

    def result(self, timeout: float | None = None) -> R:
        """Waits for the result.

        Args:
            timeout: seconds; None: as long as the job may take.

        Raises:
            TimeoutError: the job is still under way; it continues.
            Error: that the job ended with.
        """
        try:
            result = super().result(timeout)
        except concurrent.futures.TimeoutError as error:
            if isinstance(error, TimeoutError):
                raise
            raise TimeoutError from None  # Python 3.10 has two of them
        self._warn()
        return result

    def cancel(self, *, keep_result: bool = False) -> bool:
        """Cancels the job on the server; returns False if it has ended already.

        Args:
            keep_result: `result` returns the positions reached so far instead of raising
                `Cancelled`.
        """
        if self.done():
            return False
        if keep_result and not self.name:
            raise Error(
                "the server has not accepted the job yet, so there is no result to keep",
                reason="JOB_NOT_FOUND",
            )
        if keep_result or (self._kept and self.name):
            self._client.cancel(self.name, keep_result=keep_result)
        if not keep_result:
            self._control.cancel()
        return True

    def __repr__(self) -> str:
        state = "done" if self.done() else str(self._progress or "under way")
        return f"<meshsmooth.Job {self.name or self.request_id}: {state}>"
