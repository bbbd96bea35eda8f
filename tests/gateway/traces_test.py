#!/usr/bin/env python3
"""A job's spans, from a caller of HTTP to the stages of the pipeline, as a collector gets them."""

import http.server
import json
import os
import subprocess
import threading
from unittest import mock

from gateway_program import CliTest, GatewayProgram, ServerProgram, call, main

TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"
PARENT = "00f067aa0ba902b7"
STEPS = {"receive", "queue", "run", "send"}
STAGES = {"upload", "find_neighbours", "find_boundary", "iterate", "evaluate", "download"}


class Collector(http.server.ThreadingHTTPServer):
    """Takes spans by OTLP over HTTP in JSON."""

    def __init__(self):
        self.requests = []
        self.changed = threading.Condition()

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
                self.send_response(200)
                self.end_headers()
                with self.server.changed:
                    self.server.requests.append((self.path, body))
                    self.server.changed.notify_all()

            def log_message(self, *_):
                pass

        super().__init__(("127.0.0.1", 0), Handler)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def wait_for(self, name):
        """All spans, once there is one of this name."""
        def spans():
            return [span for path, body in self.requests if path == "/v1/traces" for of in body["resourceSpans"]
                    for scope in of["scopeSpans"] for span in scope["spans"]]
        with self.changed:
            if not self.changed.wait_for(lambda: any(span["name"] == name for span in spans()), timeout=60):
                raise AssertionError(f"no span {name}")
            return spans()


class Traces(CliTest):
    def test_reach_from_http_to_the_stages(self):
        collector = Collector()
        self.addCleanup(collector.server_close)
        self.addCleanup(collector.shutdown)
        server = self.start_server(collector)
        gateway = GatewayProgram(server.address, self.folder / "work")
        self.addCleanup(gateway.kill)
        mesh = self.generate("part.vtu", nodes=300)

        with open(mesh, "rb") as file:
            answer = call(gateway.port, "POST", "/v1/smooth", [("mesh", "part.vtu", file.read())],
                          headers={"traceparent": f"00-{TRACE}-{PARENT}-01"})

        self.assertEqual(answer.status, 200, answer.body)
        spans = {span["name"]: span for span in collector.wait_for("optimize")}
        self.assertEqual(set(spans), {"optimize"} | STEPS | STAGES)
        self.assertEqual({span["traceId"] for span in spans.values()}, {TRACE})
        self.assertEqual(spans["optimize"]["parentSpanId"], PARENT)
        for name in STEPS | STAGES:
            parent = "run" if name in STAGES else "optimize"
            self.assertEqual(spans[name]["parentSpanId"], spans[parent]["spanId"], name)
        attributes = {each["key"]: each["value"] for each in spans["optimize"]["attributes"]}
        self.assertEqual(attributes["meshsmooth.outcome"], {"stringValue": "succeeded"})
        self.assertEqual(attributes["meshsmooth.backend"], {"stringValue": "cpu"})
        self.assertGreater(int(attributes["meshsmooth.element_count"]["intValue"]), 300)

    def test_follow_the_environment_of_a_command(self):
        collector = Collector()
        self.addCleanup(collector.server_close)
        self.addCleanup(collector.shutdown)
        server = self.start_server(collector)
        mesh = self.generate("part.vtu", nodes=300)

        def smooth(traceparent, *flags, **expected):
            with mock.patch.dict(os.environ, TRACEPARENT=traceparent):
                return self.run_cli("smooth", mesh, "-o", self.path("better.vtu"), "--server", server.address, *flags,
                                    **expected)
        smooth(f"00-{TRACE}-{PARENT}-01")
        self.assertEqual(collector.wait_for("optimize")[0]["traceId"], TRACE)
        smooth("nonsense")  # is not passed on
        wrong = smooth("", "--traceparent", "nonsense", exit_code=2)
        self.assertIn("traceparent", wrong.stderr)

    def start_server(self, collector):
        with mock.patch.dict(os.environ, {
                "OTEL_EXPORTER_OTLP_ENDPOINT": f"http://127.0.0.1:{collector.server_port}",
                "OTEL_BSP_SCHEDULE_DELAY": "1"}):
            server = ServerProgram()
        self.addCleanup(server.kill)
        return server

    def test_wrong_variables_are_named_at_the_start(self):
        ended = subprocess.run(
            [os.environ["MESHSMOOTH_SERVER"], "--listen", "127.0.0.1:0"], capture_output=True, text=True,
            timeout=60, check=False, env={**os.environ, "OTEL_EXPORTER_OTLP_ENDPOINT": "http://127.0.0.1:1",
                                          "OTEL_EXPORTER_OTLP_PROTOCOL": "grpc"})
        self.assertEqual(ended.returncode, 2)
        self.assertIn("OTEL_EXPORTER_OTLP_PROTOCOL", ended.stderr)


if __name__ == "__main__":
    main()
