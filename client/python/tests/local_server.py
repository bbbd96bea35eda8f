"""What the tests of local servers share: processes as the kernel shows them, and fake programs."""

from __future__ import annotations

import os
import stat
import sys
import time
from collections.abc import Callable
from pathlib import Path

import grpc

FAKE_ENGINE = Path(__file__).with_name("fake_engine.py")


def eventually(is_true: Callable[[], bool], seconds: float = 60) -> bool:
    """Waits until it is true; False when that took longer than any machine should need."""
    limit = time.monotonic() + seconds
    while not is_true():
        if time.monotonic() > limit:
            return False
        time.sleep(0.01)
    return True


def is_running(pid: int) -> bool:
    """Whether the process exists and has not ended: where no init reaps, zombies stay."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def children_of(pid: int) -> list[int]:
    """The processes that it started."""
    children = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        if int(fields[1]) == pid and fields[0] != "Z":
            children.append(int(status.parent.name))
    return children


def server_info(address: str) -> bytes:
    """The encoded answer to GetServerInfo."""
    with grpc.insecure_channel(address, [("grpc.enable_http_proxy", 0)]) as channel:
        call = channel.unary_unary("/meshsmooth.v1.SmoothingService/GetServerInfo")
        return bytes(call(b"", timeout=60, wait_for_ready=True))


def write_program(path: Path, text: str) -> str:
    """A program in Python."""
    path.write_text(f"#!{sys.executable}\n{text}")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def install_fake_engine(folder: Path, name: str) -> None:
    """The program `name` in the folder; it notes its calls there, in the file calls."""
    folder.mkdir(exist_ok=True)
    write_program(folder / name, FAKE_ENGINE.read_text())


def program() -> str:
    """The server that the tests start."""
    return os.environ["MESHSMOOTH_SERVER_BINARY"]
