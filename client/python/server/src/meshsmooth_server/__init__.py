"""The program meshsmooth-server, with the libraries that it needs beyond glibc."""

import os
import sys
from typing import NoReturn

__all__ = ["path"]


def path() -> str:
    """The path of the program."""
    return os.path.join(os.path.dirname(os.path.abspath(__file__)), "bin", "meshsmooth-server")


def _main() -> NoReturn:
    """The console script: becomes the program."""
    os.execv(path(), ["meshsmooth-server", *sys.argv[1:]])
