#!/usr/bin/env python3
"""What a hostile caller of the gateway may cost the others: their answers meanwhile, and its memory."""

import contextlib
import re
import socket
import statistics
import threading
import time
import unittest
from pathlib import Path

from gateway_program import BOUNDARY, GatewayTest, form, main, wait_until

FORM = f"Host: a\r\nContent-Type: multipart/form-data; boundary={BOUNDARY}\r\n".encode()
ENDLESS = b"Content-Length: 100000000000\r\n\r\n"
# A job that runs until it is cancelled.
LONG_QUERY = "?method=laplacian&guard=off&relaxation=0.05&tolerance=0&iterations=2000000000"
PART = f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="mesh"; filename="a.vtk"\r\n\r\n'.encode()
MOST_MEGABYTES = 100
CONNECTIONS = 64


class Attacks(GatewayTest):
    """Each goes on until others were served many times."""

    gateway_arguments = ("--max-connections", str(CONNECTIONS))

    def setUp(self):
        super().setUp()
        self.stop = threading.Event()
        self.data = self.mesh("part.vtk", nodes=100)

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.gateway.port), timeout=20)

    def flood(self, opening, piece):
        """Sends pieces without end, over a new connection where one was closed."""
        while not self.stop.is_set():
            with contextlib.suppress(OSError), self.connect() as connection:
                connection.sendall(opening)
                while not self.stop.is_set():
                    connection.sendall(piece)

    def hold(self, opening, piece):
        """Three times as many connections as the gateway takes, each with a byte now and then."""
        held = []
        with contextlib.ExitStack() as stack:
            while not self.stop.is_set():
                with contextlib.suppress(OSError):
                    held.append(stack.enter_context(self.connect()))
                    held[-1].sendall(opening)
                if len(held) < 3 * CONNECTIONS:
                    continue
                self.all_held.set()
                for number, connection in enumerate(held):
                    try:
                        connection.sendall(piece)
                    except OSError:
                        connection.close()
                        held[number] = None
                held = [connection for connection in held if connection is not None]
                self.stop.wait(0.1)

    def memory(self):
        status = Path(f"/proc/{self.gateway.process.pid}/status").read_text()
        return int(re.search(r"VmHWM:\s+(\d+)", status).group(1)) // 1024

    def check_during(self, attack, opening, piece=b"", threads=2):
        self.all_held = threading.Event()
        attackers = [threading.Thread(target=attack, args=(opening, piece)) for _ in range(threads)]
        times = []
        try:
            for attacker in attackers:
                attacker.start()
            if attack == self.hold:
                self.assertTrue(self.all_held.wait(60))
            for _ in range(3):
                begin = time.monotonic()
                answer = self.smooth("part.vtk", self.data)
                self.assertEqual(answer.status, 200, answer.body)
                times.append(time.monotonic() - begin)
        finally:
            self.stop.set()
            for attacker in attackers:
                attacker.join()
        self.assertLess(statistics.median(times), 2, times)
        self.assertLess(self.memory(), MOST_MEGABYTES)
        self.assertIsNone(self.gateway.process.poll())
        self.check_nothing_left()

    def test_heads_without_end(self):
        for opening, piece in ((b"GET / HTTP/1.1\r\n", b"X: " + b"y" * 1000 + b"\r\n"), (b"GET / HTTP/1.1\r\nX: ", b"y" * 65536),
                               (b"GET /", b"y" * 65536)):
            with self.subTest(piece=piece[:4]):
                self.stop.clear()
                self.check_during(self.flood, opening, piece)

    def test_content_that_nobody_asked_for(self):
        for method in (b"DELETE /v1/jobs/ab", b"PUT /v1/smooth", b"POST /", b"POST /v1/smooth", b"GET /"):
            with self.subTest(method=method):
                self.stop.clear()
                self.check_during(self.flood, method + b" HTTP/1.1\r\n" + ENDLESS, b"y" * 65536)

    def test_forms_without_end(self):
        begin = b"POST /v1/smooth HTTP/1.1\r\n" + FORM + b"Transfer-Encoding: chunked\r\n\r\n"
        chunk = b"%x\r\n%s\r\n"
        header = b"--" + BOUNDARY.encode() + b'\r\nContent-Disposition: form-data; name="'
        for first, piece in ((header, b"y" * 65536), (b"", PART + b"\r\n"), (b"", b"\r\n--" + BOUNDARY.encode() + b" " * 60000)):
            with self.subTest(first=first[:4], piece=piece[-4:]):
                self.stop.clear()
                opening = begin + (chunk % (len(first), first) if first else b"")
                self.check_during(self.flood, opening, chunk % (len(piece), piece))

    def test_connections_that_say_nothing(self):
        self.check_during(self.hold, b"", threads=1)

    def test_heads_byte_by_byte(self):
        self.check_during(self.hold, b"GET / HTTP/1.1\r\nX: ", b"y", threads=1)

    def test_uploads_byte_by_byte(self):
        self.check_during(self.hold, b"POST /v1/smooth HTTP/1.1\r\n" + FORM + ENDLESS + PART, b"y", threads=1)

    def test_answers_that_nobody_reads(self):
        request = b"GET /openapi.json HTTP/1.1\r\nHost: a\r\nRange: bytes=" + b"0-," * 1000 + b"0-\r\n\r\n"
        self.check_during(self.hold, request, threads=1)

    def end_job(self, address):
        self.call("DELETE", address)
        wait_until(lambda: self.call("GET", address).json()["state"] == "cancelled", "the job is cancelled")
        self.call("DELETE", address)

    def test_events_without_end(self):
        job = self.call("POST", f"/v1/smooth{LONG_QUERY}", [("mesh", "a.vtk", self.mesh("a.vtk", nodes=20000))],
                        headers={"Prefer": "respond-async"})
        self.assertEqual(job.status, 202, job.body)
        address = job.headers["Location"]
        self.addCleanup(self.end_job, address)
        wait_until(lambda: self.call("GET", address).json()["state"] == "running", "the job runs")
        self.all_held = threading.Event()
        holder = threading.Thread(target=self.hold, args=(f"GET {address}/events HTTP/1.1\r\n\r\n".encode(), b""))
        holder.start()
        try:
            self.assertTrue(self.all_held.wait(60))
            self.assertEqual(self.call("GET", "/healthz").status, 200)
            self.assertEqual(self.call("GET", address).json()["state"], "running")
        finally:
            self.stop.set()
            holder.join()

    def test_lengths_that_are_none(self):
        for headers in (b"Content-Length: -1\r\n\r\n", b"Content-Length: 18446744073709551616\r\n\r\n",
                        b"Content-Length: 1\r\nContent-Length: 2\r\n\r\n", b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n",
                        b"Transfer-Encoding: chunked\r\n\r\n-2\r\n", b"Transfer-Encoding: chunked\r\n\r\nfffffffffffffffff\r\n"):
            with self.subTest(headers=headers), self.connect() as connection:
                connection.sendall(b"POST /v1/smooth HTTP/1.1\r\n" + FORM + headers + b"abc")
                self.assertRegex(connection.recv(100), rb"^HTTP/1.1 (400|413) ")

    def test_what_is_no_address(self):
        for target, status in ((b"/v1/jobs/" + b"a" * 15000, b"404"), (b"/%zz", b"400"), (b"/%", b"400"), (b"x", b"400"),
                               (b"/" + b"a" * 20000, b"431"), (b"http://other/v1/smooth", b"400"), (b"/\xff\xfe", b"404")):
            with self.subTest(target=target[:20]), self.connect() as connection:
                connection.sendall(b"GET " + target + b" HTTP/1.1\r\nHost: a\r\n\r\n")
                self.assertEqual(connection.recv(12)[9:], status)


class Forms(GatewayTest):
    def test_in_any_pieces_are_the_same(self):
        data = self.mesh("part.vtk", nodes=50)
        body = form([("mesh", "part.vtk", data)])
        head = b"POST /v1/quality HTTP/1.1\r\n" + FORM + b"Content-Length: %d\r\n\r\n" % len(body)
        whole = self.call("POST", "/v1/quality", [("mesh", "part.vtk", data)]).body
        for size in (1, 7, 4096):
            with self.subTest(size=size), socket.create_connection(("127.0.0.1", self.gateway.port), timeout=60) as connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                sent = head + body
                for at in range(0, len(sent), size):
                    connection.sendall(sent[at:at + size])
                answer = b"".join(iter(lambda: connection.recv(65536), b""))
                self.assertEqual(answer.partition(b"\r\n\r\n")[2], whole)


if __name__ == "__main__":
    main()
