"""The gateway before a server, and a caller of HTTP: what all tests of the gateway share."""

import http.client
import json
import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "cli"))

from programs import CliTest, Program, ServerProgram, main  # noqa: E402, F401

GATEWAY = os.environ["MESHSMOOTH_GATEWAY"]
BOUNDARY = "----meshsmooth-test"


class GatewayProgram(Program):
    """meshsmooth-gateway on a free port."""

    def __init__(self, server, folder, *arguments, listen="127.0.0.1:0"):
        # Sanitizers need more address space than any limit.
        super().__init__(GATEWAY, "--listen", listen, "--server", server, "--folder", str(folder),
                         "--max-client-bytes", "0", "--client", os.environ["MESHSMOOTH_CLI"], *arguments)
        self.start = json.loads(self.wait_for(r'^\{.*"event":"start".*$').group(0))
        self.port = self.start["port"]
        self.folder = Path(self.start["folder"])

    def requests_left(self):
        return sorted(path.name for path in self.folder.iterdir() if path.name != "lock")

    def children(self):
        return Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split() if (
            self.process.poll() is None) else []


def form(parts):
    """The body of a form: (name, file name, bytes) of each part."""
    body = b""
    for name, file, data in parts:
        body += (f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="{name}"; filename="{file}"\r\n'
                 "Content-Type: application/octet-stream\r\n\r\n").encode() + data + b"\r\n"
    return body + f"--{BOUNDARY}--\r\n".encode()


class Answer:
    def __init__(self, response):
        self.status = response.status
        self.headers = response.headers
        self.body = response.read()

    def json(self):
        return json.loads(self.body)


def call(port, method, path, parts=None, headers=(), body=None):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    sent = dict(headers)
    if parts is not None:
        body = form(parts)
        sent.setdefault("Content-Type", f"multipart/form-data; boundary={BOUNDARY}")
    try:
        connection.request(method, path, body=body, headers=sent)
        return Answer(connection.getresponse())
    finally:
        connection.close()


def wait_until(condition, what, seconds=60):
    """For states that nothing announces."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"still not: {what}")
        time.sleep(0.01)


class GatewayTest(CliTest):
    """A server and a gateway for all tests of the class."""

    server_arguments = ()
    gateway_arguments = ()

    @classmethod
    def setUpClass(cls):
        import tempfile
        folder = tempfile.TemporaryDirectory(prefix="meshsmooth-")
        cls.addClassCleanup(folder.cleanup)
        cls.work = Path(folder.name)
        cls.server = ServerProgram(*cls.server_arguments)
        cls.addClassCleanup(cls.server.kill)
        cls.gateway = GatewayProgram(cls.server.address, cls.work, *cls.gateway_arguments)
        cls.addClassCleanup(cls.gateway.kill)

    def start_gateway(self, *arguments, **options):
        gateway = GatewayProgram(self.server.address, self.folder / "work", *arguments, **options)
        self.addCleanup(gateway.kill)
        return gateway

    def mesh(self, name, nodes=300):
        return Path(self.generate(name, nodes=nodes)).read_bytes()

    def call(self, method, path, parts=None, gateway=None, **options):
        return call((gateway or self.gateway).port, method, path, parts, **options)

    def smooth(self, name, data, query="", **options):
        return self.call("POST", f"/v1/smooth{query}", [("mesh", name, data)], **options)

    def check_problem(self, answer, status, reason):
        self.assertEqual(answer.status, status, answer.body)
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        problem = answer.json()
        self.assertEqual(problem["status"], status)
        self.assertEqual(problem.get("reason"), reason, problem)
        self.assertTrue(problem["title"] and problem["detail"], problem)
        self.assertNotIn(str(self.work), answer.body.decode())
        return problem

    def check_nothing_left(self, gateway=None):
        gateway = gateway or self.gateway
        wait_until(lambda: not gateway.requests_left(), "no files of requests left")
