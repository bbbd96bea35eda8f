"""The future of a job."""

from __future__ import annotations

import concurrent.futures
import threading
from collections.abc import Callable
from typing import TypeVar

from ._control import Control
from ._progress import Progress

R = TypeVar("R")


class Job(concurrent.futures.Future[R]):
    """A job under way; a future that `concurrent.futures.wait` and `as_completed` take too.

    Attributes:
        request_id: the UUID under which the same job can be joined.
    """

    def __init__(
        self,
        request_id: str,
        control: Control,
        cancel: Callable[..., object],
        warn: Callable[[], None],
    ) -> None:
        super().__init__()
        self.request_id = request_id
        self._control = control
        self._cancel = cancel  # on the server, by name
        self._warn = warn
        self._progress: Progress | None = None
        self.set_running_or_notify_cancel()

    def _start(self, run: Callable[[], R]) -> None:
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
        if self._control.concerns_server(keep_result=keep_result):
            self._cancel(self.name, keep_result=keep_result)
        if not keep_result:
            self._control.cancel()
        return True

    def __repr__(self) -> str:
        state = "done" if self.done() else str(self._progress or "under way")
        return f"<meshsmooth.Job {self.name or self.request_id}: {state}>"
