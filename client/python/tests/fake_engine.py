"""Answers as docker and podman do to run, port and rm; the "image" is this machine's server.

A container is a file beside this program, named as the container, with its port.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).parent


def run(arguments: list[str]) -> int:
    """Serves like an image would, on another port than inside."""
    container = FOLDER / arguments[arguments.index("--name") + 1]
    image = arguments.index("meshsmooth-server:test")
    flags = [flag for flag in arguments[image + 1 :] if not flag.startswith("--listen=")]
    server = subprocess.Popen(
        [os.environ["MESHSMOOTH_SERVER_BINARY"], "--listen=127.0.0.1:0", *flags],
        stderr=subprocess.PIPE,
        text=True,
    )
    for line in server.stderr:
        if found := re.search(r"event=start .*?\bport=(\d+)", line):
            container.write_text(found.group(1))
        sys.stderr.write(line)
        sys.stderr.flush()
    container.unlink(missing_ok=True)
    return server.wait()


def main(command: str, *arguments: str) -> int:
    """One call of the engine."""
    with (FOLDER / "calls").open("a") as calls:
        calls.write(" ".join([command, *arguments]) + "\n")
    if command == "run":
        return run(list(arguments))
    if command == "port":
        print(f"127.0.0.1:{(FOLDER / arguments[0]).read_text()}")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
