"""Finds the program of a local server."""

from __future__ import annotations

import importlib
import os
import shutil

from ._errors import Unavailable

PROGRAM = "meshsmooth-server"
BINARY_VARIABLE = "MESHSMOOTH_SERVER_BINARY"


def find_program() -> str:
    """The path of meshsmooth-server: that of $MESHSMOOTH_SERVER_BINARY, else of the package
    meshsmooth_server, else the first on PATH.

    Raises Unavailable, which lists what was tried and what to do.
    """
    given = os.environ.get(BINARY_VARIABLE)
    if given:
        if not _is_program(given):
            raise Unavailable(
                f"cannot start a local server: ${BINARY_VARIABLE} is {given!r}, which is no "
                "executable file",
                hint="correct the variable or unset it",
            )
        return os.path.abspath(given)
    packaged = _packaged_program()
    if packaged is not None:
        if not _is_program(packaged):  # that on PATH may be the package's too
            raise Unavailable(
                f"cannot start a local server: the package meshsmooth_server lacks its program, "
                f"{packaged}",
                hint="run: pip install --force-reinstall meshsmooth-server",
            )
        return packaged
    on_path = shutil.which(PROGRAM)
    if on_path is not None:
        return os.path.abspath(on_path)
    raise Unavailable(
        f"cannot start a local server: no {PROGRAM} was found: ${BINARY_VARIABLE} is not set, the "
        "package meshsmooth_server is not installed, PATH has none",
        hint="on Linux x86-64 run: pip install 'meshsmooth[server]', or set "
        f"${BINARY_VARIABLE} to a program that you built; anywhere: set $MESHSMOOTH_SERVER to the "
        "HOST:PORT of a running server, or start an image by LocalServer(container=...)",
    )


def _packaged_program() -> str | None:
    try:
        package = importlib.import_module("meshsmooth_server")
    except ImportError:
        return None
    return str(package.path())


def _is_program(path: str) -> bool:
    return os.path.isfile(path) and os.access(path, os.X_OK)
