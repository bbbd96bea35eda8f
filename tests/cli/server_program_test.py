"""meshsmooth-server as a program: its settings, and what is seen of it from outside."""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import unittest
import urllib.parse
import urllib.request
from pathlib import Path

from programs import BAD_MESH, DONE, SERVER, USAGE, CliTest, Program, ServerProgram, main, vtk_text


class Settings(CliTest):
    def run_server(self, *arguments, exit_code=DONE, **environment):
        result = subprocess.run([SERVER, *arguments], capture_output=True, text=True, timeout=60,
                                env={**os.environ, **environment})
        self.assertEqual(result.returncode, exit_code, result.stderr)
        return result

    def test_prints_what_it_reads(self):
        printed = self.run_server("--print-config", "--lanes", "3", "--max-job-bytes", "1GiB",
                                  MESHSMOOTH_MAX_QUEUED_JOBS="7").stdout
        self.assertIn("lanes = 3\n", printed)
        self.assertIn(f"max-job-bytes = {2**30}\n", printed)
        self.assertIn("max-queued-jobs = 7\n", printed)

        (self.folder / "server.toml").write_text(printed)
        again = self.run_server("--print-config", "--config", self.path("server.toml")).stdout
        self.assertEqual(again, printed)
        again = self.run_server("--print-config", MESHSMOOTH_CONFIG=self.path("server.toml")).stdout
        self.assertEqual(again, printed)

    def test_wrong_values_end_with_field_value_source_and_exit_code(self):
        (self.folder / "server.toml").write_text("lanes = many\n")
        cases = [
            (["--lanes", "many"], {}, "flag --lanes"),
            ([], {"MESHSMOOTH_LANES": "many"}, "environment, MESHSMOOTH_LANES"),
            (["--config", self.path("server.toml")], {}, "line 1"),
        ]
        for arguments, environment, source in cases:
            with self.subTest(source):
                error = self.run_server(*arguments, exit_code=USAGE, **environment).stderr
                for part in ("lanes: ", '"many"', source):
                    self.assertIn(part, error)
                self.assertEqual(error.count("\n"), 1)

    def test_unknown_settings_are_errors(self):
        (self.folder / "server.toml").write_text("lanse = 2\n")
        error = self.run_server("--config", self.path("server.toml"), exit_code=USAGE).stderr
        self.assertIn("lanse", error)
        self.run_server("--lanse", "2", exit_code=USAGE)

    def test_unknown_variables_are_named(self):
        result = self.run_server("--print-config", MESHSMOOTH_TOKEN_FIEL="x", MESHSMOOTH_LANES="1")
        self.assertRegex(result.stderr, "ignored: .*MESHSMOOTH_TOKEN_FIEL")
        self.assertNotIn("MESHSMOOTH_LANES", result.stderr)
        for name in "MESHSMOOTH_TOKEN_FIEL", "MESHSMOOTH_SERVER", "MESHSMOOTH_PORT_50051_TCP":
            os.environ[name] = "x"
            self.addCleanup(os.environ.pop, name)
        server = Program(SERVER, "--listen", "127.0.0.1:0")
        self.addCleanup(server.kill)
        server.wait_for('event=unknown_environment.*ignored: MESHSMOOTH_TOKEN_FIEL"?$')

    def test_limits_below_every_job_are_refused(self):
        for flag in "--host-memory-limit-bytes", "--max-job-bytes":
            for value in "1", "1MiB":
                error = self.run_server("--listen", "127.0.0.1:0", flag, value,
                                        exit_code=USAGE).stderr
                self.assertIn(flag.strip("-"), error)
                self.assertIn("no job fits", error)

    def test_too_little_address_space_is_an_error_not_a_crash(self):
        # From less than the libraries need to more than the server does; the loader's code is 127.
        for kilobytes in 50_000, 100_000, 200_000, 300_000, 450_000, 600_000, 900_000:
            with self.subTest(kilobytes):
                server = Program("sh", "-c", f'ulimit -v {kilobytes}; exec "$@"', "sh", SERVER,
                                 "--listen", "127.0.0.1:0", "--lame-duck-seconds", "0")
                self.addCleanup(server.kill)
                try:
                    server.wait_for("event=start")
                    server.process.send_signal(signal.SIGTERM)
                    self.assertEqual(server.process.wait(60), DONE)
                except AssertionError:
                    code, error = server.end()
                    self.assertIn(code, (71, 127), error)
                    self.assertNotIn("terminate", error)
                    self.assertTrue(error.strip())

    def test_the_documentation_lists_them_with_their_defaults(self):
        text = (ROOT / "docs" / "operations.md").read_text()
        for line in self.run_server("--print-config").stdout.splitlines():
            key, value = line.split(" = ")
            row = next((row for row in text.splitlines()
                        if row.startswith("|") and f"`{key}`" in row.split("|")[1]), None)
            self.assertIsNotNone(row, key)
            default = row.split("|")[2].strip().strip("`")
            self.assertEqual("" if default == "–" else default, value.strip('"'), key)

    def test_an_address_in_clear_that_others_reach_is_refused(self):
        error = self.run_server("--listen", "0.0.0.0:0", exit_code=USAGE).stderr
        for part in ("listen: ", "0.0.0.0:0", "without TLS", "tls-cert", "insecure"):
            self.assertIn(part, error)
        server = Program(SERVER, "--listen", "0.0.0.0:0", "--insecure", "--i-accept-old-grpc")
        self.addCleanup(server.kill)
        server.wait_for("event=start")

    def test_raises_its_limit_of_open_files(self):
        server = Program("sh", "-c", 'ulimit -Sn 64; exec "$@"', "sh", SERVER, "--listen",
                         "127.0.0.1:0")
        self.addCleanup(server.kill)
        server.wait_for("event=start")
        limits = Path(f"/proc/{server.process.pid}/limits").read_text()
        soft, hard = re.search(r"Max open files +(\d+) +(\d+)", limits).groups()
        self.assertEqual(soft, hard)

    def with_open_files(self, count, *arguments):
        server = Program("sh", "-c", f'ulimit -n {count}; exec "$@"', "sh", SERVER, "--listen",
                         "127.0.0.1:0", "--backend", "cpu", *arguments)
        self.addCleanup(server.kill)
        return server

    def test_too_few_open_files_are_an_error(self):
        for count in 16, 24, 32, 63:
            with self.subTest(count):
                code, error = self.with_open_files(count).end()
                self.assertEqual(code, 71, error)
                self.assertIn(f"the limit of open files is {count}, at least 64", error)
                self.assertEqual(error.count("\n"), 1)

    def test_few_open_files_are_named_and_suffice(self):
        server = self.with_open_files(64)
        port = server.wait_for(r" port=(\d+)").group(1)
        room = server.wait_for(r"few_descriptors.*room for (\d+) connections.* is 4096").group(1)
        self.assertGreaterEqual(int(room), 8)
        idle = [socket.create_connection(("127.0.0.1", port)) for _ in range(100)]
        self.addCleanup(lambda: [connection.close() for connection in idle])
        self.run_cli("health", "--server", f"127.0.0.1:{port}")

    def test_a_hang_up_ends_no_job(self):
        server = Program(SERVER, "--listen", "127.0.0.1:0", "--lame-duck-seconds", "0")
        self.addCleanup(server.kill)
        server.wait_for("event=start")
        server.process.send_signal(signal.SIGHUP)
        server.process.send_signal(signal.SIGTERM)  # it comes after the other
        self.assertEqual(server.process.wait(60), DONE)

    def test_reports_its_version(self):
        version = self.run_server("--version").stdout.strip()
        report = json.loads(self.run_server("--version", "--json").stdout)
        self.assertEqual((report["version"], report["protocol"]), (version, "meshsmooth.v1"))
        self.assertIn("commit", report)

    def test_an_address_in_use_is_named(self):
        error = self.run_server("--listen", "203.0.113.1:1", "--log-level", "off", "--insecure",
                                "--i-accept-old-grpc", exit_code=USAGE).stderr
        self.assertIn("listen", error)
        self.assertIn("203.0.113.1:1", error)


ROOT = Path(__file__).parents[2]


def needs(program):
    """Skips without a program of Debian's package prometheus, and says so."""
    if shutil.which(program):
        return lambda test: test
    print(f"WARNING: {program} is not installed (apt-get install prometheus): its tests are SKIPPED",
          file=sys.stderr)
    return unittest.skip(f"{program} is not installed")


def get(url):
    with urllib.request.urlopen(url, timeout=10) as response:
        return response.read().decode()


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


class Metrics(CliTest):
    """R18: a scrape equals what the callers counted."""

    def run_jobs(self, server, succeeding=5, failing=3):
        """Jobs of one after another; what the server should count of them."""
        mesh = self.generate("mesh.vtu", nodes=1000)
        flat = self.folder / "flat.vtk"  # three tetrahedra on one triangle
        flat.write_text(vtk_text([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (0, 0, 2)],
                                 [(0, 1, 2, 3), (0, 2, 1, 4), (0, 1, 2, 5)]))
        nodes = iterations = 0
        for _ in range(succeeding):
            self.run_cli("smooth", mesh, "-o", self.path("out.vtu"), "--server", server.address,
                         "--report", self.path("report.json"), "--quiet")
            report = json.loads((self.folder / "report.json").read_text())
            nodes += int(report["nodes"]["total"])
            iterations += report["convergence"]["iteration_count"]
        for _ in range(failing):
            self.error_of("smooth", flat, "-o", self.path("out.vtk"), "--server", server.address,
                          exit_code=BAD_MESH)
        self.error_of("smooth", mesh, "-o", self.path("out.vtu"), "--server", server.address,
                      "--request-id", "mine", exit_code=USAGE)
        self.assertGreater(iterations, 0)
        return {
            'meshsmooth_jobs_total{outcome="succeeded"}': succeeding,
            'meshsmooth_jobs_total{outcome="failed",reason="FACET_OVERUSED"}': failing,
            'meshsmooth_jobs_total{outcome="refused",reason="OPTION_OUT_OF_RANGE"}': 1,
            "sum(meshsmooth_jobs_total)": succeeding + failing + 1,
            "meshsmooth_nodes_total": nodes,
            "meshsmooth_iterations_total": iterations,
            "meshsmooth_job_seconds_count": succeeding,
            "meshsmooth_queue_wait_seconds_count": succeeding + failing,
            'meshsmooth_queue_depth{priority="normal"}': 0,
            'meshsmooth_reserved_bytes{space="host"}': 0,
        }

    def test_the_documentation_lists_them(self):
        text = (ROOT / "docs" / "operations.md").read_text()
        with ServerProgram("--admin-listen", "127.0.0.1:0") as server:
            self.run_jobs(server, succeeding=1, failing=1)
            metrics = get(f"http://{server.admin_address}/metrics")
        names = [line.split()[2] for line in metrics.splitlines() if line.startswith("# TYPE")]
        self.assertGreater(len(names), 15)
        for name in names:
            self.assertIn(f"`{name}", text)

    @needs("promtool")
    def test_names_are_as_promtool_wants_them(self):
        with ServerProgram("--admin-listen", "127.0.0.1:0") as server:
            self.run_jobs(server, succeeding=1, failing=1)
            text = get(f"http://{server.admin_address}/metrics")
        checked = subprocess.run(["promtool", "check", "metrics"], input=text, text=True,
                                 capture_output=True, timeout=60)
        self.assertEqual((checked.returncode, checked.stdout + checked.stderr), (0, ""))

    @needs("prometheus")
    def test_prometheus_scrapes_what_the_callers_counted(self):
        with ServerProgram("--admin-listen", "127.0.0.1:0") as server:
            expected = self.run_jobs(server)
            config = {"global": {"scrape_interval": "100ms", "scrape_timeout": "100ms"},
                      "scrape_configs": [{"job_name": "meshsmooth", "static_configs": [
                          {"targets": [server.admin_address]}]}]}
            (self.folder / "prometheus.yml").write_text(json.dumps(config))  # JSON is YAML
            address = f"127.0.0.1:{free_port()}"
            prometheus = Program("prometheus", "--config.file", self.path("prometheus.yml"),
                                 "--storage.tsdb.path", self.path("data"),
                                 "--web.listen-address", address)
            self.addCleanup(prometheus.kill)
            prometheus.wait_for("Server is ready")
            for query, value in expected.items():
                self.assertEqual(self.ask(address, query), value, query)

    def ask(self, prometheus, query):
        url = f"http://{prometheus}/api/v1/query?" + urllib.parse.urlencode({"query": query})
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            result = json.loads(get(url))["data"]["result"]
            if result:
                self.assertEqual(len(result), 1, result)
                return float(result[0]["value"][1])
            time.sleep(0.1)
        self.fail(f"Prometheus knows nothing of {query}")


class PrivateServer(CliTest):
    """A server on a private socket that ends with its standard input."""

    def start(self, *arguments):
        program = Program(SERVER, "--listen", "unix:", "--exit-with-stdin", *arguments,
                          stdin=subprocess.PIPE)
        self.addCleanup(program.kill)
        self.addCleanup(program.process.stdin.close)
        socket_path = Path(program.wait_for(r"event=start.* listen=unix:(\S+)").group(1))
        return program, socket_path

    def test_only_its_owner_reaches_the_socket(self):
        program, path = self.start("--lame-duck-seconds", "0")
        self.assertTrue(path.is_socket())
        self.assertEqual(path.stat().st_mode & 0o777, 0o600)
        self.assertEqual(path.parent.stat().st_mode & 0o777, 0o700)
        self.run_cli("health", "--server", f"unix:{path}")
        program.process.terminate()
        self.assertEqual(program.end()[0], 0)
        self.assertFalse(path.parent.exists())

    def test_the_end_of_stdin_ends_it(self):
        program, path = self.start()
        program.process.stdin.close()
        code, log = program.end()
        self.assertEqual(code, 0, log)
        self.assertFalse(path.parent.exists())

    def test_the_end_of_stdin_stops_running_jobs(self):
        program, path = self.start()
        mesh = self.generate("mesh.vtu", nodes=20000)
        job = self.start_long_job(mesh, self.path("out.vtu"), "--server", f"unix:{path}")
        program.process.stdin.close()
        self.assertEqual(program.end()[0], 0)
        self.assertFalse(path.parent.exists())
        self.assertNotEqual(job.end()[0], DONE)

    def test_the_end_of_stdin_ends_a_server_whose_log_nobody_reads(self):
        read_end, write_end = os.pipe()
        process = subprocess.Popen([SERVER, "--listen", "unix:", "--exit-with-stdin"],
                                   stdin=subprocess.PIPE, stderr=write_end)
        self.addCleanup(process.kill)
        os.close(write_end)
        with os.fdopen(read_end) as log:
            path = Path(re.search(r" listen=unix:(\S+)", log.readline()).group(1))
        process.stdin.close()
        self.assertEqual(process.wait(timeout=60), 0)
        self.assertFalse(path.parent.exists())

    def test_stdin_does_not_matter_without_the_flag(self):
        program = Program(SERVER, "--listen", "unix:", "--lame-duck-seconds", "0",
                          stdin=subprocess.DEVNULL)
        self.addCleanup(program.kill)
        program.wait_for("event=start")
        program.process.terminate()
        code, log = program.end()
        self.assertEqual(code, 0)
        self.assertIn("event=end", log)

    def test_a_socket_elsewhere_is_its_owners_too(self):
        program = Program(SERVER, "--listen", "unix:" + self.path("socket"))
        self.addCleanup(program.kill)
        program.wait_for("event=start")
        self.assertEqual((self.folder / "socket").stat().st_mode & 0o777, 0o600)


class Logs(CliTest):
    def test_every_line_is_json(self):
        mesh = self.generate("mesh.vtu", nodes=500)
        with ServerProgram("--log-format", "json") as server:
            self.run_cli("smooth", mesh, "-o", self.path("out.vtu"), "--server", server.address,
                         "--request-id", "6f1b2d3c-0000-4000-8000-000000000001", "--report",
                         self.path("report.json"))
            self.error_of("smooth", mesh, "-o", self.path("out.vtu"), "--server", server.address,
                          "--request-id", "mine", exit_code=USAGE)
            server.process.terminate()
            code, text = server.end()
        self.assertEqual(code, 0)
        lines = [json.loads(line) for line in text.splitlines()]
        events = {line["event"]: line for line in lines}
        self.assertEqual([line["event"] for line in lines],
                         ["start", "job_end", "refused", "drain", "end"])
        self.assertTrue(all(line["time"] and line["level"] for line in lines))
        self.assertEqual(events["start"]["max_queued_jobs"], 100)
        job = events["job_end"]
        report = json.loads((self.folder / "report.json").read_text())
        self.assertEqual((job["outcome"], job["caller"], job["request_id"]),
                         ("succeeded", "anonymous", "6f1b2d3c-0000-4000-8000-000000000001"))
        self.assertEqual((job["nodes"], job["iterations"]),
                         (int(report["nodes"]["total"]), report["convergence"]["iteration_count"]))
        self.assertGreater(job["mesh_bytes"], 24 * job["nodes"])
        self.assertGreater(job["run_seconds"], 0)
        self.assertEqual(events["refused"]["reason"], "OPTION_OUT_OF_RANGE")


class Security(CliTest):
    """From the command line of the one to that of the other, with openssl's certificates."""

    def make_authority(self, name):
        self.openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes",
                     "-keyout", self.path(name + ".key"), "-out", self.path(name + ".pem"),
                     "-subj", f"/CN={name}", "-days", "1")

    def make_certificate(self, name, authority):
        self.openssl("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes",
                     "-keyout", self.path(name + ".key"), "-out", self.path(name + ".csr"),
                     "-subj", f"/CN={name}")
        (self.folder / "names").write_text("subjectAltName=IP:127.0.0.1\n")
        self.openssl("x509", "-req", "-in", self.path(name + ".csr"), "-CA",
                     self.path(authority + ".pem"), "-CAkey", self.path(authority + ".key"),
                     "-CAcreateserial", "-out", self.path(name + ".pem"), "-days", "1",
                     "-extfile", self.path("names"))

    def openssl(self, *arguments):
        subprocess.run(["openssl", *arguments], check=True, capture_output=True, timeout=60)

    def test_certificates_and_tokens(self):
        self.make_authority("ca")
        self.make_authority("stranger")
        self.make_certificate("server", "ca")
        self.make_certificate("alice", "ca")
        self.make_certificate("mallory", "stranger")
        (self.folder / "tokens").write_text("team:a-secret-token\n")
        (self.folder / "token").write_text("a-secret-token\n")
        with ServerProgram("--tls-cert", self.path("server.pem"), "--tls-key",
                           self.path("server.key"), "--tls-client-ca", self.path("ca.pem"),
                           "--token-file", self.path("tokens")) as server:
            trust = ["--server", server.address, "--tls-ca", self.path("ca.pem")]
            alice = ["--tls-cert", self.path("alice.pem"), "--tls-key", self.path("alice.key")]
            mallory = ["--tls-cert", self.path("mallory.pem"), "--tls-key", self.path("mallory.key")]
            token = ["--token-file", self.path("token")]
            self.assertIn("no jobs", self.run_cli("jobs", *trust, *alice, *token).stdout)
            self.run_cli("health", *trust, *alice)
            refused = {"exit_code": 4}
            self.assertIn("TOKEN_MISSING", self.error_of("jobs", *trust, *alice, **refused))
            self.assertIn("--tls-cert", self.error_of("jobs", *trust, *token, **refused))
            self.assertIn("--tls-cert", self.error_of("jobs", *trust, *mallory, *token, **refused))
            self.assertIn("--tls", self.error_of("jobs", "--server", server.address, **refused))
            wrong = ["--server", server.address, "--tls-ca", self.path("stranger.pem")]
            self.assertIn("--tls-ca", self.error_of("jobs", *wrong, *alice, *token, **refused))
            server.process.terminate()
            _, log = server.end()
        self.assertNotIn("a-secret-token", log)
        self.assertIn("event=denied reason=TOKEN_MISSING", log)


if __name__ == "__main__":
    main()
