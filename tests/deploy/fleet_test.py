"""A fleet: three workers behind HAProxy, with the configuration of deploy/haproxy, and Prometheus
with the rules of deploy/prometheus. 200 jobs come; in the middle one worker is killed and another
one drains. Every job is answered, with the bits of a worker alone. The steps of a mesh go to the
worker that knows it.

    fleet_test.py bench    CPU seconds a job of 1, 2 and 3 workers behind HAProxy
    fleet_test.py compose  the same test with the containers of docker/compose.yaml; MESHSMOOTH_IMAGE,
                           HAPROXY_IMAGE and PROMETHEUS_IMAGE may name other images
MESHSMOOTH_FLEET_JOBS: how many jobs; 200."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import unittest
import urllib.parse
import urllib.request
from pathlib import Path

from programs import CLI, SERVER, CliTest, Program, main

ROOT = Path(__file__).parents[2]
LOAD = os.environ["MESHSMOOTH_FLEET_LOAD"]
JOBS = int(os.environ.get("MESHSMOOTH_FLEET_JOBS", "200"))
PATIENCE = 120


def program(name):
    return shutil.which(name) or shutil.which(name, path="/usr/sbin:/sbin")


HAPROXY, PROMETHEUS = program("haproxy"), program("prometheus")


def needs(path, name):
    if path:
        return lambda test: test
    print(f"WARNING: {name} is not installed (apt-get install {name}): tests of a fleet are SKIPPED",
          file=sys.stderr)
    return unittest.skip(f"{name} is not installed")


def free_port():
    import socket
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def eventually(is_so, patience=PATIENCE):
    deadline = time.monotonic() + patience
    while not (answer := is_so()):
        if time.monotonic() > deadline:
            raise AssertionError("it did not happen")
        time.sleep(0.1)
    return answer


def haproxy_configuration(workers):
    """deploy/haproxy's, with these workers instead of those that a name resolves to."""
    text = (ROOT / "deploy/haproxy/haproxy.cfg").read_text()
    template = re.search(r"^ *server-template \S+ \S+ \S+(.*)$", text, re.M)
    lines = "\n".join(f"    server worker{i} {worker.address} port "
                      f"{worker.admin_address.split(':')[1]}{template.group(1)}"
                      for i, worker in enumerate(workers))
    return text.replace(template.group(0), lines)


class Worker(Program):
    """A small server that leaves as one behind a proxy should."""

    def __init__(self):
        super().__init__(SERVER, "--listen", "127.0.0.1:0", "--admin-listen", "127.0.0.1:0",
                         "--backend", "cpu", "--lanes", "1", "--threads-per-lane", "1",
                         "--host-memory-limit-bytes", "1GiB", "--lame-duck-seconds", "5",
                         "--drain-grace-seconds", "60")
        start = self.wait_for(r"event=start\b.*?\bport=(\d+) admin_port=(\d+)")
        self.address, self.admin_address = (f"127.0.0.1:{port}" for port in start.groups())


class Fleet:
    """Workers behind HAProxy, as processes."""

    def __init__(self, test, count):
        self.workers = []
        for _ in range(count):
            self.workers.append(Worker())
            test.addCleanup(self.workers[-1].kill)
        port = free_port()
        self.address = f"127.0.0.1:{port}"
        file = test.folder / "haproxy.cfg"
        file.write_text(haproxy_configuration(self.workers))
        environment = {**os.environ, "MESHSMOOTH_BIND": self.address}
        subprocess.run([HAPROXY, "-c", "-f", file], env=environment, check=True,
                       capture_output=True, timeout=60)
        os.environ["MESHSMOOTH_BIND"] = self.address
        self.proxy = Program(HAPROXY, "-db", "-f", str(file))
        test.addCleanup(self.proxy.kill)
        for worker in self.workers:
            eventually(lambda worker=worker: ready(worker))
        eventually(lambda: test.run_status("health", "--server", self.address) == 0)

    def processes(self):
        return [program.process.pid for program in (self.proxy, *self.workers)]


def ready(worker):
    try:
        with urllib.request.urlopen(f"http://{worker.admin_address}/readyz", timeout=10):
            return True
    except OSError:
        return False


def cpu_seconds(process):
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class FleetTest(CliTest):
    def run_status(self, *arguments):
        return subprocess.run([CLI, *arguments], capture_output=True, timeout=60).returncode

    def start_load(self, *arguments):
        """The callers, their lines as they come, and a way to wait for an answer."""
        load = subprocess.Popen([LOAD, *map(str, arguments)], stdout=subprocess.PIPE, text=True)
        self.addCleanup(load.kill)
        lines, arrived = [], threading.Condition()

        def read():
            for line in load.stdout:
                with arrived:
                    lines.append(line.strip())
                    arrived.notify_all()
            with arrived:
                lines.append("end")
                arrived.notify_all()
        threading.Thread(target=read, daemon=True).start()

        def wait_for(line):
            with arrived:
                self.assertTrue(arrived.wait_for(
                    lambda: line in lines or "end" in lines, 300), line)
                self.assertIn(line, lines)
        return load, lines, wait_for

    def figures(self, lines):
        summary = next(line for line in lines if line.startswith("jobs "))
        parts = summary.split()
        return {name: float(value) for name, value in zip(parts[::2], parts[1::2])}

    @needs(HAPROXY, "haproxy")
    @needs(PROMETHEUS, "prometheus")
    def test_loses_no_job_though_a_worker_dies_and_another_drains(self):
        alone = Worker()
        self.addCleanup(alone.kill)
        fleet = Fleet(self, 3)
        metrics = self.start_prometheus(fleet.workers)
        self.run_through_losses(
            alone.address, fleet.address, metrics, kill=fleet.workers[0].kill,
            drain=lambda: fleet.workers[1].process.send_signal(signal.SIGTERM))
        self.assertEqual(fleet.workers[1].process.wait(timeout=120), 0)

    def run_through_losses(self, reference, fleet, metrics, kill, drain):
        """All jobs, while Prometheus looks at three workers of which two are lost."""
        eventually(lambda: self.query(metrics, 'count(up{job="meshsmooth"} == 1)') == "3")
        arguments = ("--reference", reference, "--server", fleet, "--jobs", JOBS)
        # Once without a loss: a worker may die before Prometheus has looked at what it did.
        load, lines, _ = self.start_load(*arguments)
        self.assertEqual(load.wait(timeout=300), 0, lines)
        served = 'count(max_over_time(meshsmooth_jobs_total{outcome="succeeded"}[1h]) > 0)'
        eventually(lambda: self.query(metrics, served) == "3")
        load, lines, wait_for = self.start_load(*arguments)
        wait_for(f"answer {JOBS // 4}")
        kill()
        wait_for(f"answer {JOBS // 2}")
        drain()
        self.assertEqual(load.wait(timeout=300), 0, [line for line in lines if "lost" in line])
        figures = self.figures(lines)
        print(figures, file=sys.stderr)
        self.assertEqual((figures["answers"], figures["lost"], figures["different"]), (JOBS, 0, 0))
        scraped = self.query(metrics, "count(count_over_time(meshsmooth_build_info[1h]))")
        self.assertEqual(scraped, "3")
        self.assertEqual(self.query(metrics, served), "3")

    @needs(HAPROXY, "haproxy")
    def test_sends_the_steps_of_a_mesh_to_the_worker_that_knows_it(self):
        fleet = Fleet(self, 3)
        load, lines, _ = self.start_load("--reference", fleet.workers[0].address, "--server",
                                         fleet.address, "--jobs", JOBS, "--callers", 4)
        self.assertEqual(load.wait(timeout=300), 0, lines)
        figures = self.figures(lines)
        print(figures, file=sys.stderr)
        self.assertGreaterEqual(figures["reused"], 0.95 * figures["repeated"])

    def start_prometheus(self, workers):
        shutil.copy(ROOT / "deploy/prometheus/meshsmooth.rules.yml", self.folder)
        targets = [worker.admin_address for worker in workers]
        (self.folder / "prometheus.yml").write_text(json.dumps({
            "global": {"scrape_interval": "1s", "evaluation_interval": "1s"},
            "rule_files": ["meshsmooth.rules.yml"],
            "scrape_configs": [{"job_name": "meshsmooth",
                                "static_configs": [{"targets": targets}]}]}))
        address = f"127.0.0.1:{free_port()}"
        prometheus = Program(PROMETHEUS, f"--config.file={self.path('prometheus.yml')}",
                             f"--storage.tsdb.path={self.path('data')}",
                             f"--web.listen-address={address}")
        self.addCleanup(prometheus.kill)
        prometheus.wait_for("Server is ready")
        return address

    def query(self, address, expression):
        url = f"http://{address}/api/v1/query?" + urllib.parse.urlencode({"query": expression})
        try:
            with urllib.request.urlopen(url, timeout=30) as response:
                result = json.load(response)["data"]["result"]
        except OSError:
            return None
        return result[0]["value"][1] if result else None


def compose():
    """The test, with containers."""
    class Stack(FleetTest):
        def runTest(self):
            ports = {name: str(free_port()) for name in ("MESHSMOOTH_PORT", "PROMETHEUS_PORT")}
            command = ["docker-compose", "--project-name", f"meshsmooth{os.getpid()}", "--file",
                       str(ROOT / "docker/compose.yaml")]
            if not shutil.which("docker-compose"):
                command[:1] = ["docker", "compose"]

            def run(*arguments):
                return subprocess.run([*command, *arguments], env={**os.environ, **ports},
                                      check=True, stdout=subprocess.PIPE, text=True,
                                      timeout=600).stdout
            self.addCleanup(run, "down", "--volumes")
            run("up", "--detach", "--scale", "meshsmooth-server=3")
            workers = run("ps", "--quiet", "meshsmooth-server").split()
            self.assertEqual(len(workers), 3)
            fleet = "127.0.0.1:" + ports["MESHSMOOTH_PORT"]
            eventually(lambda: self.run_status("health", "--server", fleet) == 0)
            alone = Worker()
            self.addCleanup(alone.kill)

            def signal_worker(worker, name):
                subprocess.run(["docker", "kill", "--signal", name, worker], check=True,
                               stdout=subprocess.DEVNULL, timeout=60)
            self.run_through_losses(
                alone.address, fleet, "127.0.0.1:" + ports["PROMETHEUS_PORT"],
                kill=lambda: signal_worker(workers[0], "KILL"),
                drain=lambda: signal_worker(workers[1], "TERM"))
            code = subprocess.run(["docker", "wait", workers[1]], check=True, timeout=120,
                                  stdout=subprocess.PIPE, text=True).stdout
            self.assertEqual(code.strip(), "0")
    result = unittest.TextTestRunner().run(Stack())
    return 0 if result.wasSuccessful() else 1


def bench():
    """Prints a table; the CPU time is that of workers and proxy."""
    class Measurement(FleetTest):
        def runTest(self):
            print("workers  jobs/s  worker CPU-s/job  proxy CPU-s/job   sum  of one")
            first = None
            for count in (1, 2, 3):
                fleet = Fleet(self, count)
                alone = Worker()
                # What the reference does is another process's.
                load, lines, wait_for = self.start_load(
                    "--reference", alone.address, "--server", fleet.address, "--jobs", JOBS,
                    "--callers", 6)
                before = [cpu_seconds(process) for process in fleet.processes()]
                self.assertEqual(load.wait(timeout=600), 0, lines)
                used = [cpu_seconds(process) - start
                        for process, start in zip(fleet.processes(), before)]
                figures = self.figures(lines)
                proxy, workers = used[0] / JOBS, sum(used[1:]) / JOBS
                first = first or proxy + workers
                print(f"{count:7}  {JOBS / figures['seconds']:6.1f}  {workers:16.4f}  {proxy:15.4f}"
                      f"  {proxy + workers:.4f}  {(proxy + workers) / first:.2f}")
                for process in (alone, *fleet.workers, fleet.proxy):
                    process.kill()
    result = unittest.TextTestRunner().run(Measurement())
    return 0 if result.wasSuccessful() else 1


if __name__ == "__main__":
    if sys.argv[1:] in (["bench"], ["compose"]):
        sys.exit({"bench": bench, "compose": compose}[sys.argv[1]]())
    main()
