#!/usr/bin/env python3
"""The gateway: results of HTTP are those of the command line, and what is wrong is refused by name."""

import gzip
import http.client
import os
import shutil
import signal
import socket
import ssl
import subprocess
import threading
import unittest
from pathlib import Path

from gateway_program import BOUNDARY, GATEWAY, GatewayTest, call, form, main, wait_until  # noqa: F401
from programs import CLI, LONG, ServerProgram

# All of them by scripts/test --with-peers.
DISCONNECTS = 2000 if os.environ.get("MESHSMOOTH_WITH_PEERS") else 40
AT_ONCE = 64 if os.environ.get("MESHSMOOTH_WITH_PEERS") else 16
LONG_QUERY = "?method=laplacian&guard=off&relaxation=0.05&tolerance=0&iterations=2000000000"


class Results(GatewayTest):
    def expected(self, name, *arguments, result="expected"):
        extension = "".join(Path(name).suffixes)
        target = self.path(result + extension)
        self.run_cli("smooth", self.path(name), "-o", target, "--server", self.server.address, *arguments)
        return Path(target).read_bytes()

    def test_are_those_of_the_command_line_for_each_format(self):
        for name in ("part.inp", "part.vtu", "part.msh", "part.su2"):
            with self.subTest(name):
                data = self.mesh(name)
                answer = self.smooth(name, data, "?goal=worst")
                self.assertEqual(answer.status, 200, answer.body)
                self.assertEqual(answer.body, self.expected(name, "--goal", "worst"))
                stem, extension = name.split(".")
                self.assertIn(f'filename="{stem}-smooth.{extension}"', answer.headers["Content-Disposition"])
        self.check_nothing_left()

    @unittest.skipUnless(shutil.which("curl"), "curl is not installed")
    def test_a_stranger_with_curl_smooths_a_file(self):
        self.mesh("part.inp")
        address = f"http://127.0.0.1:{self.gateway.port}"
        subprocess.run(["curl", "-sS", "--fail-with-body", "-F", "mesh=@part.inp", f"{address}/v1/smooth?goal=worst",
                        "-o", "better.inp"], cwd=self.folder, check=True)
        self.assertEqual(Path(self.path("better.inp")).read_bytes(), self.expected("part.inp", "--goal", "worst"))
        refused = subprocess.run(["curl", "-sS", "--fail-with-body", "-F", "mesh=@part.inp", f"{address}/v1/smooth?gaol=worst"],
                                 cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(refused.returncode, 22)
        self.assertIn("OPTION_MISPLACED", refused.stdout)

    def test_another_format_is_written_on_request(self):
        data = self.mesh("part.inp")
        answer = self.smooth("part.inp", data, "?to=vtu")
        self.assertEqual(answer.status, 200, answer.body)
        self.assertIn(b"<VTKFile", answer.body[:200])
        self.assertIn('filename="part-smooth.vtu"', answer.headers["Content-Disposition"])
        data = self.mesh("part.vtu")
        answer = self.smooth("part.vtu", data, "?to=inp")
        self.run_cli("smooth", self.path("part.vtu"), "-o", self.path("part.inp"), "--server", self.server.address)
        self.assertEqual(answer.body, Path(self.path("part.inp")).read_bytes())

    def test_compressed_files_and_names_that_are_no_names_here(self):
        data = self.mesh("part.vtk")
        for name in ("../../x/Part.VTK", "C:\\x\\part.vtk", "a" * 300 + ".vtk", "\u00e9\u4e16;|.vtk"):
            with self.subTest(name):
                answer = self.smooth(name, data)
                self.assertEqual(answer.status, 200, answer.body)
                self.assertNotIn("/", answer.headers["Content-Disposition"])
        answer = self.smooth("part.vtk.gz", gzip.compress(data))
        self.assertEqual(answer.status, 200, answer.body)
        self.assertTrue(gzip.decompress(answer.body).startswith(b"# vtk"))
        self.check_nothing_left()

    def test_quality_is_that_of_the_command_line(self):
        data = self.mesh("part.vtu")
        answer = self.call("POST", "/v1/quality", [("mesh", "part.vtu", data)])
        self.assertEqual(answer.status, 200, answer.body)
        self.assertEqual(answer.body.decode(), self.run_cli("quality", self.path("part.vtu"), "--json").stdout)

    def test_a_report_is_a_page(self):
        answer = self.call("POST", "/v1/report?goal=worst", [("mesh", "part.vtu", self.mesh("part.vtu"))])
        self.assertEqual(answer.status, 200, answer.body)
        self.assertTrue(answer.body.startswith(b"<!DOCTYPE html>"))
        self.assertIn("sandbox", answer.headers["Content-Security-Policy"])

    def test_a_motion_is_that_of_the_command_line(self):
        data = self.mesh("part.vtk")
        there = self.path("there.vtk")
        self.run_cli("smooth", self.path("part.vtk"), "-o", there, "--boundary", "slide")
        answer = self.call("POST", "/v1/move", [("mesh", "part.vtk", data), ("to", "t.vtk", Path(there).read_bytes())])
        self.assertEqual(answer.status, 200, answer.body)
        self.run_cli("move", self.path("part.vtk"), "--to", there, "-o", self.path("moved.vtk"),
                     "--server", self.server.address)
        self.assertEqual(answer.body, Path(self.path("moved.vtk")).read_bytes())

    def test_a_reference_is_a_part_and_repeated_names_are_parameters(self):
        data = self.mesh("part.msh")
        answer = self.call("POST", "/v1/smooth?target=reference", [("mesh", "a.msh", data), ("reference", "b.msh", data)])
        self.assertEqual(answer.status, 200, answer.body)
        answer = self.smooth("part.msh", data, "?fixed-set=none-such")
        self.check_problem(answer, 400, "NAME_UNKNOWN")

    def test_many_at_once_are_all_served(self):
        data = self.mesh("part.vtk", nodes=100)
        answers = []
        threads = [threading.Thread(target=lambda: answers.append(self.smooth("part.vtk", data))) for _ in range(AT_ONCE)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual([answer.status for answer in answers], [200] * AT_ONCE)
        self.assertEqual(len({answer.body for answer in answers}), 1)


class Refusals(GatewayTest):
    gateway_arguments = ("--max-upload-bytes", "2000000")

    def test_wrong_requests_have_a_status_and_a_reason(self):
        data = self.mesh("part.vtk")
        good = [("mesh", "part.vtk", data)]
        deck = b"*INCLUDE, INPUT=/etc/hostname\n"
        cases = [
            ("GET", "/nothing", None, {}, 404, None),
            ("GET", "/v1/smooth", None, {}, 405, None),
            ("PUT", "/v1/smooth", good, {}, 405, None),
            ("POST", "/healthz", good, {}, 405, None),
            ("GET", "/v1/jobs/0123", None, {}, 404, "JOB_NOT_FOUND"),
            ("DELETE", "/v1/jobs/0123", None, {}, 404, "JOB_NOT_FOUND"),
            ("POST", "/v1/smooth?no-such=1", good, {}, 400, "OPTION_MISPLACED"),
            ("POST", "/v1/smooth?output=/tmp/x", good, {}, 400, "OPTION_MISPLACED"),
            ("POST", "/v1/smooth?server=evil:1", good, {}, 400, "OPTION_MISPLACED"),
            ("POST", "/v1/quality?goal=worst", good, {}, 400, "OPTION_MISPLACED"),
            ("POST", "/v1/smooth?goal=best", good, {}, 400, "OPTION_OUT_OF_RANGE"),
            ("POST", "/v1/smooth?iterations=many", good, {}, 400, "OPTION_OUT_OF_RANGE"),
            ("POST", "/v1/smooth?feature-angle=1000&boundary=slide", good, {}, 400, "OPTION_OUT_OF_RANGE"),
            ("POST", "/v1/smooth?method=taubin&goal=worst", good, {}, 400, "OPTION_MISPLACED"),
            ("POST", "/v1/smooth?target=reference", good, {}, 400, "OPTION_MISPLACED"),
            ("POST", "/v1/smooth?to=../x", good, {}, 415, "FORMAT_UNKNOWN"),
            ("POST", "/v1/smooth?to=nothing", good, {}, 415, "FORMAT_UNKNOWN"),
            ("POST", "/v1/smooth?to=stl", good, {}, 422, "ELEMENT_NOT_SUPPORTED"),
            ("POST", "/v1/smooth", [("mesh", "part", data)], {}, 415, "FORMAT_UNKNOWN"),
            ("POST", "/v1/smooth", [("mesh", "part.doc", data)], {}, 415, "FORMAT_UNKNOWN"),
            ("POST", "/v1/smooth", [("mesh", "part.vtk", data[:700])], {}, 422, None),
            ("POST", "/v1/smooth", [("mesh", "part.vtk", b"")], {}, 422, "FILE_TRUNCATED"),
            ("POST", "/v1/smooth", [("mesh", "part.inp", deck)], {}, 422, "REFERENCE_REFUSED"),
            ("POST", "/v1/smooth", [("mesh", "case.foam", b"x")], {}, 422, "REFERENCE_REFUSED"),
            ("POST", "/v1/smooth", [], {}, 400, "UPLOAD_INVALID"),
            ("POST", "/v1/smooth", [("other", "part.vtk", data)], {}, 400, "UPLOAD_INVALID"),
            ("POST", "/v1/smooth", good + good, {}, 400, "UPLOAD_INVALID"),
            ("POST", "/v1/smooth", good, {"Content-Type": "text/plain"}, 400, "UPLOAD_INVALID"),
            ("POST", "/v1/smooth", good, {"Content-Type": "multipart/form-data; boundary=other"}, 400, "UPLOAD_INVALID"),
            ("POST", "/v1/move", good, {}, 400, "OPTION_MISPLACED"),
            ("POST", "/v1/move?displacement=none", good, {}, 400, "NAME_UNKNOWN"),
            ("POST", "/v1/smooth", good, {"Authorization": "Basic eDp5"}, 401, "TOKEN_UNKNOWN"),
            ("POST", "/v1/smooth", [("mesh", "part.vtk", b" " * 3000000)], {}, 413, "UPLOAD_TOO_LARGE"),
        ]
        for method, path, parts, headers, status, reason in cases:
            with self.subTest(f"{method} {path} {headers}"):
                answer = self.call(method, path, parts, headers=headers)
                problem = answer.json()
                self.check_problem(answer, status, reason if reason else problem.get("reason"))
        self.check_nothing_left()
        self.assertEqual(self.smooth("part.vtk", data).status, 200)

    def test_an_error_names_the_file_as_the_form_does_and_the_place_in_it(self):
        problem = self.smooth("part.inp", b"*NODE\n1, 0, 0\n2, x, 0\n").json()
        self.assertTrue(problem["detail"].startswith("mesh.inp: line 3"), problem)

    def test_an_upload_without_a_length_is_bounded_too(self):
        body = form([("mesh", "part.vtk", b" " * 3000000)])
        chunks = (body[at:at + 65536] for at in range(0, len(body), 65536))
        answer = self.call("POST", "/v1/smooth", body=chunks, headers={
            "Content-Type": f"multipart/form-data; boundary={BOUNDARY}"})
        self.check_problem(answer, 413, "UPLOAD_TOO_LARGE")
        self.check_nothing_left()

    def test_values_are_no_flags(self):
        data = self.mesh("part.vtk")
        for value in ("--output=/tmp/x", "-o", "a --server=evil:1"):
            self.check_problem(self.smooth("part.vtk", data, "?fixed-set=" + value.replace(" ", "%20")), 400, "NAME_UNKNOWN")
        self.check_problem(self.smooth("part.vtk", data, "?periodic=a&periodic=--server"), 400, "OPTION_OUT_OF_RANGE")
        self.check_problem(self.smooth("part.vtk", data, "?periodic=a"), 400, "OPTION_MISPLACED")


class Limits(GatewayTest):
    def hold_place(self, gateway):
        """The address of a job that does not end."""
        answer = self.smooth("part.vtk", self.mesh("part.vtk", nodes=20000), LONG_QUERY, gateway=gateway,
                             headers={"Prefer": "respond-async"})
        self.assertEqual(answer.status, 202, answer.body)
        return answer.headers["Location"]

    def test_more_requests_than_allowed_are_told_to_come_again(self):
        gateway = self.start_gateway("--max-requests", "1")
        job = self.hold_place(gateway)
        data = self.mesh("part.vtk")
        answer = self.smooth("part.vtk", data, gateway=gateway)
        self.check_problem(answer, 503, "QUEUE_FULL")
        self.assertGreater(int(answer.headers["Retry-After"]), 0)
        self.assertEqual(self.call("GET", "/healthz", gateway=gateway).status, 200)
        self.call("DELETE", job, gateway=gateway)
        wait_until(lambda: self.smooth("part.vtk", data, gateway=gateway).status == 200, "the place is free again")
        self.call("DELETE", job, gateway=gateway)
        self.check_nothing_left(gateway)

    def test_a_job_ends_with_its_time(self):
        gateway = self.start_gateway("--job-timeout", "1")
        answer = self.smooth("part.vtk", self.mesh("part.vtk", nodes=20000), LONG_QUERY, gateway=gateway)
        self.check_problem(answer, 504, "DEADLINE_RUNNING")
        self.check_nothing_left(gateway)

    def test_addresses_of_other_machines_need_a_word(self):
        ended = subprocess.run([GATEWAY, "--listen", "0.0.0.0:0", "--server", self.server.address], capture_output=True,
                               text=True, timeout=60, check=False)
        self.assertEqual(ended.returncode, 2)
        self.assertIn("--insecure", ended.stderr)
        data = self.mesh("part.vtk")
        gateway = self.start_gateway("--insecure", listen="0.0.0.0:0")
        answer = self.smooth("part.vtk", data, gateway=gateway)
        self.check_problem(answer, 401, "TOKEN_MISSING")
        gateway = self.start_gateway("--insecure", "--allow-anonymous", listen="0.0.0.0:0")
        self.assertEqual(self.smooth("part.vtk", data, gateway=gateway).status, 200)

    @unittest.skipUnless(shutil.which("openssl"), "openssl is not installed")
    def test_its_own_certificate_makes_it_https(self):
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes",
                        "-keyout", "key.pem", "-out", "cert.pem", "-days", "2", "-subj", "/CN=localhost",
                        "-addext", "subjectAltName=IP:127.0.0.1"], cwd=self.folder, check=True, capture_output=True)
        gateway = self.start_gateway("--listen-tls-cert", self.path("cert.pem"), "--listen-tls-key", self.path("key.pem"))
        connection = http.client.HTTPSConnection(
            "127.0.0.1", gateway.port, timeout=60, context=ssl.create_default_context(cafile=self.path("cert.pem")))
        self.addCleanup(connection.close)
        connection.request("POST", "/v1/quality", body=form([("mesh", "part.vtk", self.mesh("part.vtk"))]),
                           headers={"Content-Type": f"multipart/form-data; boundary={BOUNDARY}"})
        answer = connection.getresponse()
        self.assertEqual(answer.status, 200)
        self.assertIn(b"element_count", answer.read())


class Tokens(GatewayTest):
    @classmethod
    def setUpClass(cls):
        import tempfile
        tokens = tempfile.NamedTemporaryFile("w", suffix=".tokens")
        cls.addClassCleanup(tokens.close)
        tokens.write("alice:secret-of-alice-0123456789abcdef\n")
        tokens.flush()
        cls.server_arguments = ("--token-file", tokens.name)
        super().setUpClass()

    def test_are_passed_on_to_the_server(self):
        data = self.mesh("part.vtk")
        good = {"Authorization": "Bearer secret-of-alice-0123456789abcdef"}
        self.assertEqual(self.smooth("part.vtk", data, headers=good).status, 200)
        answer = self.smooth("part.vtk", data)
        self.check_problem(answer, 401, "TOKEN_MISSING")
        self.assertEqual(answer.headers["WWW-Authenticate"], "Bearer")
        self.check_problem(self.smooth("part.vtk", data, headers={"Authorization": "Bearer other"}), 401, "TOKEN_UNKNOWN")

    def test_are_checked_before_an_upload_where_strangers_can_reach_it(self):
        gateway = self.start_gateway("--insecure", listen="0.0.0.0:0")
        for token, status, reason in (("other", 401, "TOKEN_UNKNOWN"), ("secret-of-alice-0123456789abcdef", 422, "FILE_TRUNCATED")):
            answer = self.call("POST", "/v1/quality", [("mesh", "a.vtk", b"")], gateway=gateway,
                               headers={"Authorization": f"Bearer {token}"})
            self.check_problem(answer, status, reason)


class Ends(GatewayTest):
    def test_nothing_is_left_of_callers_who_leave(self):
        data = self.mesh("part.vtk", nodes=2000)
        body = form([("mesh", "part.vtk", data)])
        head = (f"POST /v1/smooth{LONG_QUERY} HTTP/1.1\r\nHost: x\r\nContent-Length: {len(body)}\r\nContent-Type: "
                f"multipart/form-data; boundary={BOUNDARY}\r\n\r\n").encode()

        def leave(number):
            with socket.create_connection(("127.0.0.1", self.gateway.port)) as connection:
                # In the head, in the form, or while the job runs.
                sent = head + body
                connection.sendall(sent[:len(sent) * (number % 3 + 1) // 3])
                if number % 2:  # as a process that is killed: a reset
                    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")

        for first in range(0, DISCONNECTS, 20):
            threads = [threading.Thread(target=leave, args=(first + n,)) for n in range(20)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        self.check_nothing_left()
        answer = self.smooth("part.vtk", data)
        self.assertEqual(answer.status, 200, answer.body)
        wait_until(lambda: "RUNNING" not in self.run_cli("jobs", "--server", self.server.address).stdout,
                   "no job of theirs runs")

    def start_long(self, gateway):
        data = self.mesh("part.vtk", nodes=20000)
        answers = []
        thread = threading.Thread(target=lambda: answers.append(self.smooth("part.vtk", data, LONG_QUERY, gateway=gateway)))
        thread.start()
        wait_until(lambda: list(gateway.folder.glob("*/printed")), "a client runs")
        return thread, answers

    def test_a_signal_ends_it_when_its_jobs_have_ended(self):
        gateway = self.start_gateway("--drain-grace", "1")
        thread, answers = self.start_long(gateway)
        gateway.process.send_signal(signal.SIGTERM)
        thread.join()
        self.check_problem(answers[0], 503, "DRAINING")
        code, _ = gateway.end()
        self.assertEqual(code, 0)
        self.assertFalse(gateway.folder.exists())

    def test_what_a_killed_one_leaves_goes_with_the_next(self):
        gateway = self.start_gateway()
        data = self.mesh("part.vtk", nodes=20000)
        body = form([("mesh", "part.vtk", data)])
        connection = socket.create_connection(("127.0.0.1", gateway.port))
        self.addCleanup(connection.close)
        connection.sendall((f"POST /v1/smooth{LONG_QUERY} HTTP/1.1\r\nHost: x\r\nContent-Length: {len(body)}\r\n"
                            f"Content-Type: multipart/form-data; boundary={BOUNDARY}\r\n\r\n").encode() + body)
        wait_until(lambda: list(gateway.folder.glob("*/printed")), "a client runs")
        gateway.kill()
        self.assertTrue(gateway.folder.exists())
        self.start_gateway()
        self.assertFalse(gateway.folder.exists())

    def test_is_ready_while_the_server_is(self):
        server = ServerProgram()
        self.addCleanup(server.kill)
        from gateway_program import GatewayProgram
        gateway = GatewayProgram(server.address, self.folder / "work")
        self.addCleanup(gateway.kill)
        self.assertEqual(self.call("GET", "/readyz", gateway=gateway).status, 200)
        server.kill()
        wait_until(lambda: self.call("GET", "/readyz", gateway=gateway).status == 503, "it is not ready")
        self.assertEqual(self.call("GET", "/healthz", gateway=gateway).status, 200)
        self.check_problem(self.smooth("part.vtk", self.mesh("part.vtk"), "?timeout=1", gateway=gateway), 503, "UNAVAILABLE")


if __name__ == "__main__":
    main()
