#!/usr/bin/env python3
"""The OpenAPI document is what the gateway does."""

import json
import os
import re
from pathlib import Path

from gateway_program import GatewayTest, main

ROOT = Path(__file__).resolve().parent.parent.parent
# The gateway's own: the client has other names for them, or none.
OWN = {"to", "partial"}
# Each wrong value takes a process; all of them by scripts/test --with-peers.
STEP = 1 if os.environ.get("MESHSMOOTH_WITH_PEERS") else 4


class Document(GatewayTest):
    def setUp(self):
        super().setUp()
        self.document = self.call("GET", "/openapi.json").json()

    def test_is_the_one_of_the_repository(self):
        self.assertEqual(self.document, json.loads((ROOT / "client/gateway/openapi.json").read_text(encoding="utf-8")))

    def test_has_every_path_and_method(self):
        for path, methods in self.document["paths"].items():
            for method, operation in methods.items():
                with self.subTest(f"{method} {path}"):
                    answer = self.call(method.upper(), path.replace("{job}", "0123"), [] if method == "post" else None)
                    known = operation["responses"]
                    self.assertTrue(str(answer.status) in known or "reason" in answer.json(), answer.body)
            for method in {"get", "post", "put", "delete", "patch"} - set(methods):
                answer = self.call(method.upper(), path.replace("{job}", "0123"))
                self.check_problem(answer, 405, None)
                allowed = set(methods) | ({"head"} if "get" in methods else set())
                self.assertEqual(answer.headers["Allow"].lower().split(", "), sorted(allowed))

    def test_has_parameters_and_parts_of_the_client_by_the_same_names(self):
        # What the gateway decides itself, and what it has not.
        left_out = {"output", "output-format", "report", "html", "server", "tls", "tls-ca", "tls-cert", "tls-key",
                    "tls-server-name", "token-file", "quiet", "progress", "self-contained", "help", "result-ttl",
                    "request-id", "traceparent", "json", "require", "csv", "npz", "elements-json"}
        for command in ("smooth", "move", "quality"):
            flags = set(re.findall(r"^\s+(?:-\w,)?--([a-z0-9-]+)", self.run_cli(command, "--help").stdout, re.M))
            post = self.document["paths"][f"/v1/{command}"]["post"]
            names = {of["name"] for of in post["parameters"] if of["in"] == "query"} - OWN
            parts = set(post["requestBody"]["content"]["multipart/form-data"]["schema"]["properties"]) - {"mesh"}
            self.assertEqual(flags - left_out, names | parts, command)

    def test_choices_and_ranges_are_the_client_s(self):
        data = self.mesh("part.vtk", nodes=100)
        for parameter in self.document["paths"]["/v1/smooth"]["post"]["parameters"][::STEP]:
            schema, name = parameter["schema"], parameter["name"]
            if parameter["in"] != "query" or name in OWN:
                continue
            wrong = None
            if "enum" in schema:
                wrong = "no-such"
            elif schema["type"] in ("number", "integer"):
                wrong = str(schema["minimum"] - 1) if "minimum" in schema else str(schema.get("exclusiveMinimum", "nan"))
            if wrong is None:
                continue
            with self.subTest(name):
                answer = self.smooth("part.vtk", data, f"?{name}={wrong}")
                self.assertIn(answer.json().get("reason"), ("OPTION_OUT_OF_RANGE", "OPTION_MISPLACED"), answer.body)
                self.assertEqual(answer.status, 400)

    def test_the_problem_is_as_declared(self):
        problem = self.smooth("part.vtk", b"", "?no=1").json()
        declared = self.document["components"]["schemas"]["Problem"]
        self.assertLessEqual(set(problem), set(declared["properties"]))
        self.assertLessEqual(set(declared["required"]), set(problem))


if __name__ == "__main__":
    main()
