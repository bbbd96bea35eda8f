"""A server of its own: started when it is first needed, gone with this process."""

from __future__ import annotations

import collections
import contextlib
import os
import socket
import threading
import weakref
from collections.abc import Mapping, Sequence
from types import TracebackType

from ._container import Container
from ._errors import Unavailable
from ._find_server import find_program
from ._server_process import ServerProcess

Setting = bool | int | float | str

# Nobody else uses the server: it need not stay ready for others while it ends.
_SETTINGS: dict[str, Setting] = {"warm-up": False, "lame-duck-seconds": 0, "drain-grace-seconds": 0}
_OWN_SETTINGS: dict[str, Setting] = {
    "listen": "unix:",
    "exit-with-stdin": True,
    "log-level": "info",  # the line that reports the start
    "log-format": "text",
}
# What the environment says about servers for others must not reach a private one.
_FOREIGN_VARIABLES = ("CONFIG", "LISTEN", "ADMIN_LISTEN", "TOKEN_FILE", "TLS_", "LOG_", "INSECURE")


class LocalServer:
    """A meshsmooth server that this process starts for itself and that ends with it.

    The program is started when `address` is first read. It serves on a Unix socket that only this
    user can open, in a private folder, and ends, socket and folder with it, when it is closed, when
    the object is deleted, or when the process ends, by `kill -9` too. Processes forked meanwhile
    use their parent's server as long as it runs and then start one of their own. Thread-safe.

        with LocalServer() as server:
            client = Client(server.address)

    The program is that of `$MESHSMOOTH_SERVER_BINARY`, else of the package `meshsmooth-server`
    (`pip install meshsmooth[server]`), else the first `meshsmooth-server` on PATH.
    """

    def __init__(
        self,
        *,
        settings: Mapping[str, Setting] | None = None,
        container: str | None = None,
        engine: str | None = None,
        engine_options: Sequence[str] = (),
        start_timeout: float = 60.0,
    ) -> None:
        """Starts nothing yet.

        Args:
            settings: settings of docs/operations.md by name, as in `{"backend": "cpu"}`. Those
                about addresses, TLS, tokens and the log are not taken from the environment.
            container: an image to start instead of the program. It serves on a free port of
                127.0.0.1, which every user of this machine can reach.
            engine: the program that runs the image, by name or path; None: docker, else podman.
            engine_options: options of its `run`, as in `("--gpus", "all")`.
            start_timeout: seconds until the server must serve; an image that is not here yet is
                pulled within them.

        Raises:
            ValueError: a setting that LocalServer itself sets, or an engine without a container.
        """
        given = {name.replace("_", "-"): value for name, value in (settings or {}).items()}
        taken = sorted(given.keys() & _OWN_SETTINGS.keys())
        if taken:
            raise ValueError(f"settings: LocalServer sets {', '.join(taken)} itself")
        if container is None and (engine is not None or engine_options):
            raise ValueError("engine and engine_options need container, the image to start")
        self._settings = _SETTINGS | given
        self._container = container
        self._engine = engine
        self._engine_options = tuple(engine_options)
        self._start_timeout = start_timeout
        self._lock = threading.Lock()
        self._process: ServerProcess | None = None
        self._address: str | None = None
        self._closed = False
        _servers.add(self)

    @property
    def address(self) -> str:
        """The server's gRPC target.

        It is `unix:PATH` or, of a container, `127.0.0.1:PORT`. Starts the server unless it runs, so
        the first use takes as long as that.

        Raises:
            Unavailable: it cannot be started, or it has ended; with the last lines of its log.
            ValueError: it was closed.
        """
        with self._lock:
            if self._closed:
                raise ValueError("the local server is closed")
            if self._process is not None:
                failure = self._process.failure()
                if failure is not None:
                    raise Unavailable(failure)
            elif self._address is None or not _accepts(self._address):  # a parent's
                self._address = self._start()
            assert self._address is not None
            return self._address

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    def failure(self, wait: float = 0.0) -> str | None:
        """How the server ended by itself, with the last lines of its log; None if it did not.

        Args:
            wait: seconds to wait for its end: a connection breaks before the process is gone.
        """
        process = self._process
        return None if process is None else process.failure(wait)

    def close(self) -> None:
        """Ends the server and its jobs, and returns when it has ended; may be repeated.

        In a forked process the parent's server goes on.
        """
        with self._lock:
            self._closed = True
            process, self._process = self._process, None
        if process is not None:
            process.stop()

    def __enter__(self) -> LocalServer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        state = "closed" if self._closed else self._address or "not started"
        return f"<LocalServer: {state}>"

    def _start(self) -> str:
        settings = self._settings | _OWN_SETTINGS
        if self._container is None:
            program = find_program()
            name, command = f"the local server {program}", [program, *_flags(settings)]
            process = ServerProcess(name, command, _environment(), _remove_socket)
        else:
            container = Container(self._engine)
            flags = _flags(
                settings | {"listen": container.listen, "insecure": True, "i-accept-old-grpc": True}
            )  # published on loopback only
            command = container.command(self._container, self._engine_options, flags)
            name = f"the container of {self._container}"
            process = ServerProcess(name, command, os.environ, lambda _: container.remove())
        try:
            address = process.wait_until_serving(self._start_timeout)
            if self._container is not None:
                address = container.published_address()
        except BaseException:
            process.stop()
            raise
        self._process = process
        # Not at exit: children that multiprocessing joins there may still use it.
        weakref.finalize(self, process.release).atexit = False
        return address

    def _after_fork_in_child(self) -> None:
        self._lock = threading.Lock()  # another thread of the parent may hold the old one
        self._process = None


_servers: weakref.WeakSet[LocalServer] = weakref.WeakSet()
_default: LocalServer | None = None
_default_lock = threading.Lock()
# Addresses and ends of those that were replaced while calls to them were under way.
_endings: collections.deque[tuple[str | None, str]] = collections.deque(maxlen=8)


def default_server() -> LocalServer:
    """The local server of this process, for calls that name none; the same for all threads.

    One that was closed or has ended is replaced by another.
    """
    global _default
    with _default_lock:
        failure = None if _default is None else _default.failure()
        if _default is not None and failure is not None:
            _endings.append((_default._address, failure))
        if _default is None or _default.closed or failure is not None:
            _default = LocalServer()
        return _default


def failure_at(address: str, wait: float = 5.0) -> str | None:
    """How the local server at an address ended by itself; None if it runs or is none of ours.

    Args:
        address: as `LocalServer.address`.
        wait: seconds to wait for its end, as of `LocalServer.failure`.
    """
    for server in list(_servers):
        if server._address == address:
            return server.failure(wait)
    return dict(_endings).get(address)


def _flags(settings: Mapping[str, Setting]) -> list[str]:
    return [
        f"--{name}={str(value).lower() if isinstance(value, bool) else value}"
        for name, value in settings.items()
    ]


def _environment() -> dict[str, str]:
    foreign = tuple("MESHSMOOTH_" + name for name in _FOREIGN_VARIABLES)
    return {name: value for name, value in os.environ.items() if not name.startswith(foreign)}


def _accepts(address: str) -> bool:
    """Whether something accepts connections there."""
    with contextlib.suppress(OSError):
        if address.startswith("unix:"):
            with socket.socket(socket.AF_UNIX) as connection:
                connection.connect(address.removeprefix("unix:"))
        else:
            host, _, port = address.rpartition(":")
            socket.create_connection((host, int(port)), 5).close()
        return True
    return False


def _remove_socket(listen: str | None) -> None:
    """Removes what a killed server has left; one that ends by itself removes all of it."""
    if listen is None:
        return
    folder = os.path.dirname(listen.removeprefix("unix:"))
    for name in ("socket", "leases"):
        with contextlib.suppress(OSError):
            os.unlink(os.path.join(folder, name))
    with contextlib.suppress(OSError):
        os.rmdir(folder)


def _after_fork_in_child() -> None:
    global _default_lock
    _default_lock = threading.Lock()
    for server in list(_servers):
        server._after_fork_in_child()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork_in_child)
