#!/usr/bin/env python3
"""Jobs with an address: progress, result, cancelling, and who may see them."""

import http.client
import json

from gateway_program import GatewayTest, main, wait_until

LONG_QUERY = "?method=laplacian&guard=off&relaxation=0.05&tolerance=0&iterations=2000000000"
ASYNC = {"Prefer": "respond-async"}


class Jobs(GatewayTest):
    gateway_arguments = ("--max-kept-jobs", "2")

    def start(self, data, query="", **options):
        answer = self.smooth("part.vtu", data, query, headers=ASYNC | options.pop("headers", {}), **options)
        self.assertEqual(answer.status, 202, answer.body)
        self.assertEqual(answer.headers["Preference-Applied"], "respond-async")
        location = answer.headers["Location"]
        self.assertEqual(location, "/v1/jobs/" + answer.json()["id"])
        return location

    def events(self, location, until=lambda event, data: False):
        """Name and data of each event, until the end or the condition."""
        connection = http.client.HTTPConnection("127.0.0.1", self.gateway.port, timeout=60)
        connection.request("GET", location + "/events")
        answer = connection.getresponse()
        self.assertEqual(answer.headers["Content-Type"], "text/event-stream")
        events, name = [], None
        while line := answer.readline().decode():
            if line.startswith("event: "):
                name = line[7:].strip()
            elif line.startswith("data: "):
                events.append((name, json.loads(line[6:])))
                if until(*events[-1]):
                    break
        connection.close()
        return events

    def test_has_the_result_of_the_call_that_waits_and_a_report_besides(self):
        data = self.mesh("part.vtu")
        location = self.start(data, "?goal=worst")
        events = self.events(location)
        self.assertEqual((events[-1][0], events[-1][1]["state"]), ("end", "done"))
        self.assertEqual(self.call("GET", location).json()["state"], "done")
        result = self.call("GET", location + "/result")
        self.assertEqual(result.body, self.smooth("part.vtu", data, "?goal=worst").body)
        self.assertIn('filename="part-smooth.vtu"', result.headers["Content-Disposition"])
        self.assertTrue(self.call("GET", location + "/report").body.startswith(b"<!DOCTYPE html>"))
        self.assertIn("quality_after", self.call("GET", location + "/summary").json())
        self.assertEqual(self.call("DELETE", location).status, 204)
        self.check_problem(self.call("GET", location), 404, "JOB_NOT_FOUND")
        self.check_nothing_left()

    def test_is_cancelled_by_delete(self):
        location = self.start(self.mesh("part.vtu", nodes=20000), LONG_QUERY)
        self.events(location, lambda _, job: job.get("progress", {}).get("iteration", 0) > 0)
        self.check_problem(self.call("GET", location + "/result"), 409, "JOB_NOT_FINISHED")
        self.assertEqual(self.call("DELETE", location).status, 204)
        end = self.events(location)[-1]
        self.assertEqual((end[0], end[1]["state"], end[1]["problem"]["reason"]), ("end", "cancelled", "CANCELLED_BY_JOB_CALL"))
        self.check_problem(self.call("GET", location + "/result"), 503, "CANCELLED_BY_JOB_CALL")
        self.assertEqual(self.call("DELETE", location).status, 204)
        self.check_nothing_left()

    def test_that_fails_says_why(self):
        location = self.start(b"<VTKFile", "")
        problem = self.events(location)[-1][1]["problem"]
        self.assertEqual(problem["status"], 422, problem)
        self.check_problem(self.call("GET", location + "/result"), 422, problem["reason"])
        self.call("DELETE", location)
        self.check_nothing_left()

    def test_the_oldest_that_has_ended_makes_room(self):
        data = self.mesh("part.vtu")
        locations = []
        for _ in range(3):
            locations.append(self.start(data))
            self.events(locations[-1])
        self.check_problem(self.call("GET", locations[0]), 404, "JOB_NOT_FOUND")
        for location in locations[1:]:
            self.assertEqual(self.call("DELETE", location).status, 204)
        self.check_nothing_left()

    def test_goes_when_its_time_is_over(self):
        gateway = self.start_gateway("--result-ttl", "1")
        location = self.start(self.mesh("part.vtu"), gateway=gateway)
        wait_until(lambda: self.call("GET", location, gateway=gateway).status == 404, "it is gone")
        self.check_nothing_left(gateway)

    def test_is_seen_by_its_caller_alone(self):
        location = self.start(self.mesh("part.vtu"), headers={"Authorization": "Bearer alice"})
        self.check_problem(self.call("GET", location), 404, "JOB_NOT_FOUND")
        self.check_problem(self.call("DELETE", location, headers={"Authorization": "Bearer bob"}), 404, "JOB_NOT_FOUND")
        self.assertEqual(self.call("GET", location, headers={"Authorization": "Bearer alice"}).status, 200)
        wait_until(lambda: self.call("GET", location, headers={"Authorization": "Bearer alice"}).json()["state"] != "running", "ended")
        self.call("DELETE", location, headers={"Authorization": "Bearer alice"})


if __name__ == "__main__":
    main()
