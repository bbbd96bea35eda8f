"""meshsmooth bench: what it counts, and how it ends."""

import json
import re
import subprocess
import time
from pathlib import Path

from programs import CLI, REFUSED, STOPPED, USAGE, CliTest, ServerProgram, main

QUICK = ["--method", "laplacian", "--iterations", "1"]


class Bench(CliTest):
    def bench(self, server, *arguments, **expected):
        self.run_cli("bench", "--server", server.address, *QUICK, "--json", self.path("figures.json"),
                     *arguments, **expected)
        return json.loads((self.folder / "figures.json").read_text())

    def test_a_closed_loop_of_a_mix_of_sizes(self):
        with ServerProgram() as server:
            figures = self.bench(server, "--clients", 3, "--nodes", "300:4,2000", "--seconds", 5,
                                 "--window", 0.2)
        self.assertEqual(figures["loop"], "closed")
        self.assertEqual(figures["nodes"], ["300:4", "2000"])
        self.assertGreater(figures["ok"], 0)
        self.assertEqual((figures["refused"], figures["failed"]), (0, 0))
        self.assertAlmostEqual(figures["jobs_per_second"], figures["ok"] / figures["seconds"], 3)
        self.assertGreater(figures["megabytes_up_per_second"], figures["megabytes_down_per_second"])
        latency = figures["latency_seconds"]
        self.assertLess(0, latency["p50"])
        for less, more in (("p50", "p90"), ("p90", "p99"), ("p99", "p99.9"), ("p99.9", "max")):
            self.assertLessEqual(latency[less], latency[more])
        if figures["steady"]:
            self.assertGreaterEqual(figures["window_count"], 3)

    def test_an_open_loop_sends_what_is_due(self):
        with ServerProgram() as server:
            figures = self.bench(server, "--rate", 20, "--nodes", 300, "--jobs", 30, "--seconds", 60,
                                 "--window", 100)
        self.assertEqual(figures["loop"], "open")
        self.assertEqual(figures["due_jobs_per_second"], 20)
        self.assertEqual(figures["ok"], 30)

    def test_ends_after_so_many_jobs(self):
        with ServerProgram() as server:
            figures = self.bench(server, "--clients", 2, "--nodes", 300, "--jobs", 7, "--window", 100)
        self.assertEqual((figures["ok"], figures["refused"], figures["failed"]), (7, 0, 0))
        self.assertFalse(figures["steady"])

    def test_refusals_are_counted_by_reason(self):
        with ServerProgram("--max-jobs-per-caller", "1") as server:
            figures = self.bench(server, "--clients", 4, "--nodes", 2000, "--jobs", 200,
                                 "--window", 100)
        self.assertEqual(figures["ok"] + figures["refused"] + figures["failed"], 200)
        self.assertEqual(figures["failed"], 0)
        self.assertGreater(figures["refused"], 0)
        self.assertEqual(figures["refused_by_reason"], {"QUOTA_EXCEEDED": figures["refused"]})

    def test_a_mesh_that_never_fits_is_refused(self):
        with ServerProgram("--max-node-count", "1000") as server:
            result = subprocess.run(
                [CLI, "bench", "--server", server.address, *QUICK, "--nodes", "300,2000", "--jobs",
                 "40", "--window", "100"], capture_output=True, text=True, timeout=120)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout, r"refused MESH_TOO_LARGE \d+")

    def test_an_interrupt_shows_what_was_measured(self):
        output = self.interrupt_bench(self.wait_until_jobs_run, "--window", "100")
        self.assertRegex(output, r"ok [1-9]\d*, refused 0, failed 0")

    def test_an_interrupt_does_not_wait_for_the_next_arrival(self):
        output = self.interrupt_bench(lambda server: time.sleep(1), "--rate", "0.001")
        self.assertIn("refused 0, failed 0", output)

    def interrupt_bench(self, wait, *flags):
        with ServerProgram() as server:
            bench = subprocess.Popen(
                [CLI, "bench", "--server", server.address, *QUICK, "--nodes", "300", "--seconds",
                 "1000", *flags], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            self.addCleanup(bench.kill)
            self.wait_until_interrupts_are_caught(bench)
            wait(server)
            bench.send_signal(2)
            output, error = bench.communicate(timeout=60)
        self.assertEqual(bench.returncode, STOPPED, error)
        return output

    def wait_until_interrupts_are_caught(self, process):
        """Before that an interrupt ends it."""
        blocked = re.compile(r"^SigBlk:\t\w+[2367abef]$", re.M)  # SIGINT is the second bit
        while not blocked.search(Path(f"/proc/{process.pid}/status").read_text()):
            self.assertIsNone(process.poll())
            time.sleep(0.01)

    def wait_until_jobs_run(self, server):
        for _ in range(1000):
            jobs = self.run_cli("jobs", "--server", server.address, "--json").stdout
            if "STATE_SUCCEEDED" in jobs:
                return
        self.fail("no job was sent")

    def test_nobody_there_is_an_error(self):
        self.error_of("bench", "--server", "127.0.0.1:1", exit_code=REFUSED)

    def test_wrong_sizes_are_usage(self):
        with ServerProgram() as server:
            error = self.error_of("bench", "--server", server.address, "--nodes", "5", exit_code=USAGE)
        self.assertIn("--nodes 5", error)


if __name__ == "__main__":
    main()
