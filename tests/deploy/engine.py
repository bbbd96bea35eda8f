"""A Docker engine for tests: the one that answers, or one started for them."""

import contextlib
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path


class NoEngine(Exception):
    pass


@contextlib.contextmanager
def docker_engine():
    """A `Docker`. Throws NoEngine where none can be had."""
    client = shutil.which("docker")
    if client is None:
        raise NoEngine("there is no docker (apt-get install docker.io)")
    if subprocess.run([client, "info"], capture_output=True, timeout=60).returncode == 0:
        yield Docker(client, {})
        return
    program = shutil.which("dockerd")
    if program is None or os.geteuid() != 0:
        raise NoEngine("no Docker engine answers, and only root can start one")
    with tempfile.TemporaryDirectory(prefix="meshsmooth-") as folder:
        log = Path(folder) / "log"
        host = f"unix://{folder}/socket"
        with open(log, "w") as output:
            # Its own everything, and no network: containers share the loopback device.
            engine = subprocess.Popen(
                [program, "--host", host, "--data-root", f"{folder}/data", "--exec-root",
                 f"{folder}/exec", "--pidfile", f"{folder}/pid", "--bridge", "none",
                 "--iptables=false", "--ip-forward=false"], stdout=output, stderr=output)
        try:
            environment = {"DOCKER_HOST": host}
            deadline = time.monotonic() + 60
            while subprocess.run([client, "info"], capture_output=True, timeout=60,
                                 env={**os.environ, **environment}).returncode != 0:
                if engine.poll() is not None or time.monotonic() > deadline:
                    raise NoEngine("dockerd does not start: " + log.read_text()[-1000:])
                time.sleep(0.2)
            yield Docker(client, environment)
        finally:
            engine.terminate()
            engine.wait(timeout=60)


class Docker:
    """Docker's client, for one engine."""

    def __init__(self, client, environment):
        self.client = client
        self.environment = {**os.environ, "DOCKER_BUILDKIT": "0", **environment}

    def __call__(self, *command, exit_code=0):
        """Runs a command to its end: what it wrote to both streams."""
        result = subprocess.run([self.client, *map(str, command)], stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, text=True, timeout=300,
                                env=self.environment)
        if result.returncode != exit_code:
            raise AssertionError(f"docker {command}: exit code {result.returncode}\n"
                                 f"{result.stdout}")
        return result.stdout

    def start(self, *command, output):
        """The same, not waited for."""
        return subprocess.Popen([self.client, *map(str, command)], stdout=output, stderr=output,
                                env=self.environment)
