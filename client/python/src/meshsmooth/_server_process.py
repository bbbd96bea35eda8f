"""A server as a child process whose standard input is its lifetime."""

from __future__ import annotations

import collections
import contextlib
import json
import logging
import os
import re
import signal
import subprocess
import threading
import weakref
from collections.abc import Callable, Mapping, Sequence

from ._errors import Unavailable

_log = logging.getLogger("meshsmooth.server")  # what the local server logs

_KEPT_LINES = 10
_STOP_SECONDS = 10.0

# Value of the key `listen` in the line that the server logs once it serves; quoted as in JSON.
_START = re.compile(r'\bevent=start\b.*? listen=("(?:[^"\\]|\\.)*"|\S+)')

# Held from the creation of a pipe until the fork hook knows it. A fork in between would leave the
# child with the pipe, and the server alive after its owner.
_spawn_lock = threading.Lock()
_processes: weakref.WeakSet[ServerProcess] = weakref.WeakSet()


class _Descriptor:
    """A file descriptor that is closed once, whichever threads do it."""

    def __init__(self, number: int) -> None:
        self.number = number
        self._open = [number]

    def close(self) -> None:
        with contextlib.suppress(IndexError):
            os.close(self._open.pop())


class ServerProcess:
    """A server started by `command`, which must log as text and end with its standard input.

    This process holds the other end of that pipe: when it closes it or ends, by whatever means,
    the server ends. Thread-safe.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        environment: Mapping[str, str],
        clean_up: Callable[[str | None], None],
    ) -> None:
        """`clean_up` is called with the address, if known, once the process has ended.

        Errors call the server `name`. Raises Unavailable when the program cannot be executed.
        """
        self._name = name
        self._clean_up = clean_up
        self._lines: collections.deque[str] = collections.deque(maxlen=_KEPT_LINES)
        self._changed = threading.Condition()
        self._listen: str | None = None
        self._exit_code: int | None = None
        with _spawn_lock:
            self._spawn(command, environment)
            _processes.add(self)
        # A daemon, since only the end of this process may end the server.
        threading.Thread(target=self._read_log, name="meshsmooth-server", daemon=True).start()

    def wait_until_serving(self, seconds: float) -> str:
        """The value of the server's setting `listen`, once it serves.

        Raises Unavailable with the last lines of the log when it ends before or takes longer.
        """
        with self._changed:
            self._changed.wait_for(
                lambda: self._listen is not None or self._exit_code is not None, seconds
            )
            if self._exit_code is not None:
                raise Unavailable(self._report(f"it {_ending(self._exit_code)}"))
            if self._listen is None:
                raise Unavailable(self._report(f"it did not serve within {seconds:g} s"))
            return self._listen

    def failure(self, wait: float = 0.0) -> str | None:
        """How the server ended, with the last lines of its log; None if it runs after `wait` s."""
        with self._changed:
            self._changed.wait_for(lambda: self._exit_code is not None, wait)
            if self._exit_code is None:
                return None
            return self._report(f"it {_ending(self._exit_code)}")

    def release(self) -> None:
        """Lets the server end, without waiting for it."""
        self._stdin.close()

    def stop(self) -> None:
        """Ends the server and returns when it has ended; it is killed if that takes 10 s."""
        self.release()
        with self._changed:
            if not self._changed.wait_for(lambda: self._exit_code is not None, _STOP_SECONDS):
                self._process.kill()
                self._changed.wait_for(lambda: self._exit_code is not None, _STOP_SECONDS)

    def disown(self) -> None:
        """Closes what a child process has inherited: the server is not this process's."""
        self._stdin.close()
        self._log.close()
        self._process.returncode = 0  # no child of this process, Popen must not wait for it

    def _spawn(self, command: Sequence[str], environment: Mapping[str, str]) -> None:
        # Numbers, not file objects: a daemon thread inside a buffered read may crash the
        # interpreter when it shuts down.
        stdin, own_stdin = os.pipe()
        own_log, stderr = os.pipe()
        self._stdin, self._log = _Descriptor(own_stdin), _Descriptor(own_log)
        try:
            self._process = subprocess.Popen(
                list(command),
                stdin=stdin,
                stdout=subprocess.DEVNULL,
                stderr=stderr,
                env=dict(environment),
                start_new_session=True,  # a terminal's Ctrl-C is not for the server
            )
        except OSError as error:
            self._stdin.close()
            self._log.close()
            raise Unavailable(f"cannot run {command[0]}: {error.strerror}") from error
        finally:
            os.close(stdin)
            os.close(stderr)

    def _read_log(self) -> None:
        rest = b""
        while data := os.read(self._log.number, 65536):
            *lines, rest = (rest + data).split(b"\n")
            for line in lines:
                self._add_line(line.decode(errors="replace"))
        if rest:
            self._add_line(rest.decode(errors="replace"))
        self._log.close()
        exit_code = self._process.wait()
        try:
            self._clean_up(self._listen)
        finally:
            with self._changed:
                self._exit_code = exit_code
                self._changed.notify_all()

    def _add_line(self, line: str) -> None:
        _log.debug("%s", line)
        found = _START.search(line)
        with self._changed:
            if found is None:
                if line.strip():
                    self._lines.append(line)
            elif self._listen is None:
                value = found.group(1)
                self._listen = json.loads(value) if value.startswith('"') else value
                self._changed.notify_all()

    def _report(self, what: str) -> str:
        log = " | ".join(self._lines) if self._lines else "none"
        return f"{self._name} does not run: {what}; its last log lines: {log}"


def _ending(exit_code: int) -> str:
    if exit_code >= 0:
        return f"ended with exit code {exit_code}"
    try:
        name = signal.Signals(-exit_code).name
    except ValueError:
        name = f"signal {-exit_code}"
    return f"was ended by {name}"


def _after_fork_in_child() -> None:
    for process in list(_processes):
        process.disown()
    _processes.clear()
    _spawn_lock.release()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=_spawn_lock.acquire,
        after_in_parent=_spawn_lock.release,
        after_in_child=_after_fork_in_child,
    )
