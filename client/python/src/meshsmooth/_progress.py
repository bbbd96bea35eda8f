"""How far a job is, and how a terminal or notebook shows it."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

from .v1 import smoothing_pb2 as pb


@dataclass(frozen=True, kw_only=True)
class Progress:
    """The progress of a job, as the server last reported it.

    Attributes:
        state: "receiving", "queued", "running", "sending", "succeeded", "failed", "cancelled" or
            "expired".
        queue_position: 1 = next; 0 = not queued.
        stage: "find_neighbours", "find_boundary", "iterate" or "evaluate"; "" unless running.
        iteration: sweeps done.
        max_displacement: largest move of the last sweep, in the mesh's unit.
        rms_displacement: root mean square of its moves.
    """

    state: str
    queue_position: int = 0
    stage: str = ""
    iteration: int = 0
    max_displacement: float = 0.0
    rms_displacement: float = 0.0

    def __str__(self) -> str:
        if self.state == "queued":
            return f"queued at position {self.queue_position}"
        if self.stage == "iterate":
            return f"iteration {self.iteration}, largest move {self.max_displacement:.3g}"
        return self.stage.replace("_", " ") or self.state


def decode_progress(message: pb.Progress) -> Progress:
    """Returns a progress as callers see it."""
    return Progress(
        state=enum_name(pb.State, "STATE_", message.state),
        queue_position=message.queue_position,
        stage="" if not message.stage else enum_name(pb.Stage, "STAGE_", message.stage),
        iteration=message.iteration,
        max_displacement=message.max_displacement,
        rms_displacement=message.rms_displacement,
    )


def decode_job_state(job: pb.Job) -> Progress:
    """Returns the progress of a job that was just accepted."""
    state = enum_name(pb.State, "STATE_", job.state or pb.STATE_RECEIVING)
    return Progress(state=state, queue_position=job.queue_position)


def enum_name(enum: Any, prefix: str, value: int) -> str:
    """Returns "running" of STATE_RUNNING; the number of what a newer server adds."""
    try:
        return str(enum.Name(value)).removeprefix(prefix).lower()
    except ValueError:
        return str(value)


class Display(Protocol):
    """Shows the progress of one job."""

    def __call__(self, progress: Progress) -> object: ...
    def close(self) -> None: ...


class _Callback:
    def __init__(self, function: Callable[[Progress], object]) -> None:
        self._function = function

    def __call__(self, progress: Progress) -> object:
        return self._function(progress)

    def close(self) -> None:
        pass


class _Rich:
    def __init__(self) -> None:
        from rich.console import Console
        from rich.status import Status

        self._status: Any = Status("sending", console=Console(stderr=True))
        self._status.start()

    def __call__(self, progress: Progress) -> object:
        self._status.update(str(progress))
        return None

    def close(self) -> None:
        self._status.stop()


class _Tqdm:
    def __init__(self) -> None:
        from tqdm.auto import tqdm

        self._bar: Any = tqdm(unit=" sweeps", desc="meshsmooth")

    def __call__(self, progress: Progress) -> object:
        self._bar.update(max(0, progress.iteration - self._bar.n))
        self._bar.set_postfix_str(str(progress))
        return None

    def close(self) -> None:
        self._bar.close()


class _Plain:
    """One line a second at most, for terminals and logs without either."""

    def __init__(self) -> None:
        self._next = 0.0

    def __call__(self, progress: Progress) -> object:
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + 1
            print(f"meshsmooth: {progress}", file=sys.stderr)
        return None

    def close(self) -> None:
        pass


def _in_notebook() -> bool:
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return type(shell).__name__ == "ZMQInteractiveShell"


def make_display(
    progress: bool | Callable[[Progress], object] | None, *, alone: bool = True
) -> Display | None:
    """Returns what shows a job's progress; None if nobody wants to see it.

    Args:
        progress: a function, or True: rich or else tqdm on a terminal, tqdm in a notebook, lines
            elsewhere.
        alone: no other job is shown at the same time, as rich wants it.
    """
    if callable(progress):
        return _Callback(progress)
    if not progress:
        return None
    kinds: list[Callable[[], Display]] = []
    if _in_notebook():
        kinds = [_Tqdm]
    elif sys.stderr.isatty():
        kinds = [_Rich, _Tqdm] if alone else [_Tqdm]
    for kind in kinds:
        # Missing, or unable to show: some versions of rich have one live display at a time.
        with contextlib.suppress(Exception):
            return kind()
    return _Plain()


class Tee:
    """A display that also notes the progress in a job."""

    def __init__(self, note: Callable[[Progress], None], display: Display | None) -> None:
        self._note = note
        self._display = display

    def __call__(self, progress: Progress) -> object:
        self._note(progress)
        return None if self._display is None else self._display(progress)

    def close(self) -> None:
        if self._display is not None:
            self._display.close()


@contextlib.contextmanager
def closing(display: Display | None) -> Iterator[None]:
    """Closes the display of a job at its end."""
    try:
        yield
    finally:
        if display is not None:
            display.close()
