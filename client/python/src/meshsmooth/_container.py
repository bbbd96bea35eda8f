"""A server in a container, by the program docker or podman."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
from collections.abc import Sequence

from ._errors import Unavailable

_ENGINES = ("docker", "podman")
_PORT = "50051"
_COMMAND_SECONDS = 60


class Container:
    """A container that serves on a free port of 127.0.0.1.

    Its standard input is that of the engine's program: when that ends, the container does too.
    """

    listen = f"0.0.0.0:{_PORT}"

    def __init__(self, engine: str | None) -> None:
        """Raises Unavailable without an engine."""
        self._engine = find_engine(engine)
        self._name = f"meshsmooth-{os.urandom(8).hex()}"

    def command(self, image: str, options: Sequence[str], flags: Sequence[str]) -> list[str]:
        """What runs the image: `options` are the engine's, `flags` the server's."""
        return [
            *(self._engine, "run", "--rm", "--interactive", "--name", self._name),
            *("--publish", f"127.0.0.1::{_PORT}"),
            *options,
            image,
            *flags,
        ]

    def published_address(self) -> str:
        """Where the container is reached. Raises Unavailable."""
        output = self._run("port", self._name, f"{_PORT}/tcp")
        for line in output.splitlines():
            if line.startswith("127.0.0.1:"):
                return line.strip()
        raise Unavailable(f"cannot find the port of the container {self._name}: {output.strip()}")

    def remove(self) -> None:
        """Removes it in case the engine's program was killed; else it is gone already."""
        self._run("rm", "--force", self._name)

    def _run(self, *arguments: str) -> str:
        with contextlib.suppress(OSError, subprocess.TimeoutExpired):
            return subprocess.run(
                [self._engine, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                timeout=_COMMAND_SECONDS,
                check=False,
            ).stdout
        return ""


def find_engine(engine: str | None) -> str:
    """The path of the program that runs containers: `engine`, else docker or podman.

    Raises Unavailable when there is none.
    """
    names = (engine,) if engine else _ENGINES
    for name in names:
        path = shutil.which(name)
        if path is not None:
            return path
    raise Unavailable(
        f"cannot start a container: PATH has no {' or '.join(names)}",
        hint="install one, or give its path as LocalServer(container=..., engine=...)",
    )
