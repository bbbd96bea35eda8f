"""Many small jobs in one thread."""

from __future__ import annotations

import collections
import threading
import time
import weakref
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from ._connection import Running
from ._errors import is_of_one_mesh
from ._job import Job

_Entry = tuple[Job[Any], Callable[[], Running[Any]]]

# Under way at a time: enough to keep connection and lanes busy, and few arrays in memory.
_MANY_SMALL, _SOME_LARGE = 64, 8
_PATIENCE_SECONDS = 0.002  # of which most small jobs need a fraction


class Pipeline:
    """Runs small jobs in a thread of its own: it begins all that there are, then ends the oldest.

    A thread for each job would spend most of its time on handing over the interpreter's lock. The
    caller begins jobs itself while the thread waits long for the answers of another.
    """

    def __init__(self) -> None:
        """Starts no thread yet."""
        self._changed = threading.Condition()
        self._queued: collections.deque[_Entry] = collections.deque()
        self._begun: collections.deque[tuple[Job[Any], Running[Any]]] = collections.deque()
        self._beginning = threading.Lock()
        self._waits_since = 0.0  # of the thread; 0: it is about to begin what is queued
        self._closed = False
        self._thread: threading.Thread | None = None
        self._took: weakref.WeakSet[Job[Any]] = weakref.WeakSet()

    def add(self, job: Job[Any], run: Callable[[], Running[Any]]) -> None:
        """Runs a job as soon as possible."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="small-jobs", daemon=True)
            self._thread.start()
        self._took.add(job)
        with self._changed:
            self._queued.append((job, run))
            self._changed.notify()
        self._help()

    def room_beside(self, job: object) -> int:
        """Returns how many jobs of the size of this one should be under way at a time."""
        return _MANY_SMALL if job in self._took or isinstance(job, Exception) else _SOME_LARGE

    def result(self, job: Job[Any]) -> Any:
        """Returns the result of a job."""
        while not job.done() and self._queued:
            try:
                return job.result(_PATIENCE_SECONDS)
            except TimeoutError:
                self._help()
        return job.result()

    def close(self) -> None:
        """Ends the thread after the jobs that it has."""
        with self._changed:
            self._closed = True
            self._changed.notify()

    def _help(self) -> None:
        if self._waits_since and time.monotonic() - self._waits_since >= _PATIENCE_SECONDS:
            self._begin()

    def _begin(self) -> None:
        with self._beginning:
            while self._queued:
                job, run = self._queued.popleft()
                try:
                    running = run()
                    running.begin()
                except Exception as error:
                    job.set_exception(error)
                else:
                    with self._changed:  # the thread may have nothing to wait for meanwhile
                        self._begun.append((job, running))
                        self._changed.notify()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._queued or self._begun or self._closed)
            self._begin()
            if self._begun:
                self._waits_since = time.monotonic()
                job, running = self._begun.popleft()
                job._run(running.result)
                self._waits_since = 0.0
            elif self._closed:
                return


def results_in_order(
    meshes: Iterable[Any],
    max_in_flight: int | None,
    submit: Callable[[Any, Pipeline], Job[Any]],
    *,
    keep_errors: bool,
) -> Iterator[Any]:
    """Yields the results of the jobs of many meshes; cancels those that are left over.

    Args:
        meshes: that `submit` takes, with the pipeline of small jobs.
        max_in_flight: jobs at a time; None: by their size.
        submit: starts the job of a mesh, or raises what is wrong with it.
        keep_errors: the error of one mesh is yielded in place of its result, not raised.
    """
    pipeline = Pipeline()
    jobs: collections.deque[Job[Any] | Exception] = collections.deque()

    def first_result() -> Any:
        job = jobs[0]
        try:
            if isinstance(job, Exception):
                raise job
            result = pipeline.result(job)
        except Exception as error:
            if not (keep_errors and (error is job or is_of_one_mesh(error))):
                raise
            result = error
        jobs.popleft()  # not before: until then it may have to be cancelled
        return result

    try:
        for mesh in meshes:
            if jobs and len(jobs) >= (max_in_flight or pipeline.room_beside(jobs[-1])):
                yield first_result()
            try:
                jobs.append(submit(mesh, pipeline))
            except Exception as error:
                jobs.append(error)
                if not keep_errors:
                    break
        while jobs:
            yield first_result()
    finally:
        for job in jobs:
            if not isinstance(job, Exception):
                job.cancel()
        pipeline.close()
