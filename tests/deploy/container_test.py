"""R21: the images' containers, as nobody, with a read-only root and without any capability: they
start, smooth the demo mesh, and drain on SIGTERM.

MESHSMOOTH_IMAGE and MESHSMOOTH_CLIENT_IMAGE name the images (scripts/images makes them); without
them one is made of the built programs by the last stages of docker/Dockerfile.
MESHSMOOTH_DEMO_NODES: how large the demo mesh is; 3000, and 100000 for the whole of it."""

import os
import re
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

from engine import NoEngine, docker_engine
from programs import SERVER, CliTest, main

ROOT = Path(__file__).parents[2]
NODES = int(os.environ.get("MESHSMOOTH_DEMO_NODES", "3000"))
# How long the job that meets the drain computes: more than `docker kill` takes.
BUDGET_SECONDS = 8
LOCKED_DOWN = ["--read-only", "--cap-drop", "ALL", "--security-opt", "no-new-privileges",
               "--network", "none"]


def said(log):
    return Path(log.name).read_text()


def make_image(docker):
    """An image of the built programs."""
    build = Path(SERVER).parents[1]
    tag = f"meshsmooth-test:{os.getpid()}"
    with tempfile.TemporaryDirectory(prefix="meshsmooth-") as folder:
        subprocess.run([ROOT / "docker/pack", build, f"{folder}/image", "meshsmooth-server",
                        "meshsmooth"], check=True, timeout=300)
        text = (ROOT / "docker/Dockerfile").read_text()
        text = text[text.index("FROM scratch AS image"):text.index("FROM serving AS server-cuda")]
        text, count = re.subn(r"COPY --from=\S+ /image /", "COPY image /", text)
        assert count == 1
        (Path(folder) / "Dockerfile").write_text(text)
        docker("build", "--tag", tag, folder)
    return tag


class Containers(CliTest):
    @classmethod
    def setUpClass(cls):
        try:
            cls.docker = cls.enterClassContext(docker_engine())
        except NoEngine as problem:
            raise unittest.SkipTest(str(problem)) from None
        cls.image = os.environ.get("MESHSMOOTH_IMAGE")
        if not cls.image:
            cls.image = make_image(cls.docker)
            cls.addClassCleanup(cls.docker, "image", "rm", "--force", cls.image)
        cls.client_image = os.environ.get("MESHSMOOTH_CLIENT_IMAGE") or cls.image

    def serve(self, *arguments):
        """A server's container, once it is healthy."""
        container = self.docker(
            "run", "--detach", *LOCKED_DOWN, "--health-interval", "1s", "--env",
            "MESHSMOOTH_INSECURE=true", "--env", "MESHSMOOTH_I_ACCEPT_OLD_GRPC=true", "--env", "MESHSMOOTH_LAME_DUCK_SECONDS=1",
            "--env", "MESHSMOOTH_DRAIN_GRACE_SECONDS=300", *arguments, self.image).strip()
        self.addCleanup(self.docker, "rm", "--force", container)
        deadline = time.monotonic() + 120
        while (health := self.inspect(container, ".State.Health.Status")) != "healthy":
            self.assertLess(time.monotonic(), deadline, (health, self.docker("logs", container)))
            time.sleep(0.2)
        return container

    def inspect(self, what, field):
        return self.docker("inspect", "--format", "{{" + field + "}}", what).strip()

    def client(self, container, *arguments):
        """docker's arguments for the client's image, beside the server."""
        return ["run", "--rm", *LOCKED_DOWN[:-1], f"container:{container}", "--volume",
                f"{self.folder}:/data", "--workdir", "/data", "--entrypoint",
                "/usr/bin/meshsmooth", self.client_image, *arguments]

    def demo(self, nodes):
        before = self.generate("before.vtu", nodes=nodes)
        self.folder.chmod(0o777)  # the container's user is another
        return before

    def test_smooths_the_demo_mesh_as_the_program_does(self):
        before = self.demo(nodes=NODES)
        self.run_cli("smooth", before, "-o", self.path("here.vtu"), "--backend", "cpu")
        container = self.serve()
        self.docker(*self.client(container, "smooth", "before.vtu", "-o", "after.vtu", "--server",
                                 "127.0.0.1:50051"))
        self.assertEqual(self.path_bytes("after.vtu"), self.path_bytes("here.vtu"))
        self.assertEqual(self.inspect(container, ".HostConfig.CapDrop"), "[ALL]")
        self.assertEqual(self.inspect(container, ".HostConfig.ReadonlyRootfs"), "true")
        process = self.inspect(container, ".State.Pid")
        status = Path(f"/proc/{process}/status").read_text()
        self.assertIn("Uid:\t65532\t65532\t65532\t65532\n", status)
        self.assertRegex(status, r"CapEff:\t0+\n")
        self.assertRegex(status, r"CapBnd:\t0+\n")

    def path_bytes(self, name):
        return (self.folder / name).read_bytes()

    def test_drains_on_sigterm_and_ends_with_0(self):
        self.demo(nodes=NODES)
        container = self.serve()
        with open(self.folder / "log", "w+") as log:
            job = self.docker.start(
                *self.client(container, "smooth", "before.vtu", "-o", "after.vtu", "--server",
                             "127.0.0.1:50051", "--method", "laplacian", "--guard", "off",
                             "--relaxation", "0.05", "--tolerance", "0", "--iterations",
                             "2000000000", "--compute-budget", BUDGET_SECONDS), output=log)
            self.addCleanup(job.kill)
            deadline = time.monotonic() + 60
            while "iterate" not in said(log):
                self.assertIsNone(job.poll(), said(log))
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.05)
            self.docker("kill", "--signal", "TERM", container)
            self.assertEqual(self.docker("wait", container).strip(), "0")
            self.assertEqual(job.wait(timeout=60), 0, said(log))
        self.assertTrue((self.folder / "after.vtu").exists())
        log = self.docker("logs", container)
        self.assertLess(log.index("event=drain"), log.rindex("event=job_end"), log)

    def test_refuses_to_serve_in_clear_unless_told(self):
        said = self.docker("run", "--rm", *LOCKED_DOWN, self.image, exit_code=2)
        self.assertIn("insecure", said)

    def test_holds_no_shell_and_says_what_it_holds(self):
        for program in ("/bin/sh", "/bin/bash", "/usr/bin/dpkg"):
            self.docker("run", "--rm", *LOCKED_DOWN, "--entrypoint", program, self.image,
                        exit_code=127)
        self.assertEqual(self.inspect(self.image, ".Config.User"), "65532:65532")
        self.assertIn("org.opencontainers.image.version", self.inspect(self.image, ".Config.Labels"))
        # Named, as the engine may write warnings beside an id.
        container = self.folder.name
        self.docker("create", "--name", container, self.image)
        self.addCleanup(self.docker, "rm", container)
        target = self.folder / "sbom.spdx"
        self.docker("cp", f"{container}:/usr/share/meshsmooth/sbom.spdx", target)
        sbom = target.read_text()
        for package, how in (("libc6", "DYNAMIC"), ("libtbb12", "DYNAMIC"), ("libgrpc-dev", "STATIC"),
                             ("libssl-dev", "STATIC"), ("libcli11-dev", "STATIC")):
            self.assertIn(f"Relationship: SPDXRef-meshsmooth {how}_LINK SPDXRef-deb-{package}\n", sbom)
        self.assertRegex(sbom, r"PackageName: libc6\n(.*\n)*?PackageVersion: 2\.\d+")


if __name__ == "__main__":
    main()
