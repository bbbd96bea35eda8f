"""An image's root file system holds whatever NVIDIA's driver loads, and serves under chroot as its
user. Needs neither a container engine nor a GPU; chroot needs root."""

import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from programs import CLI, SERVER
from test_main import main

ROOT = Path(__file__).parents[2]
LIBRARIES = "usr/lib/x86_64-linux-gnu"
# What libcuda.so.1 of driver 550 is linked to.
OF_GLIBC = ("libc.so.6", "libdl.so.2", "libm.so.6", "libpthread.so.0", "librt.so.1")


def run(*command, exit_code=0):
    """A command to its end: what it wrote to both streams."""
    result = subprocess.run(list(map(str, command)), text=True, timeout=300,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if result.returncode != exit_code:
        raise AssertionError(f"{command}: exit code {result.returncode}\n{result.stdout}")
    return result.stdout


class Image(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory(prefix="meshsmooth-"))
        cls.folder = Path(folder)
        cls.root = cls.folder / "image"
        run(ROOT / "docker/pack", Path(SERVER).parents[1], cls.root, "meshsmooth-server",
            "meshsmooth")
        # A driver that does nothing, but is linked as the true one is.
        cls.driver = cls.folder / "driver"
        cls.driver.mkdir()
        run("cc", "-shared", "-o", cls.driver / "libcuda.so.1", "-Wl,--no-as-needed",
            *(f"-l:{name}" for name in OF_GLIBC))

    def check_driver(self, exit_code=0):
        return run(ROOT / "docker/check-driver", self.root, self.driver / "libcuda.so.1",
                   exit_code=exit_code)

    def without(self, path):
        """Takes a file away until the test ends."""
        hidden = self.folder / "hidden"
        shutil.move(self.root / path, hidden)
        self.addCleanup(shutil.move, hidden, self.root / path)

    def test_holds_what_a_driver_loads(self):
        self.check_driver()

    def test_each_library_that_a_driver_misses_is_named(self):
        for name in ("libdl.so.2", "libm.so.6", "libpthread.so.0", "librt.so.1"):
            with self.subTest(name):
                self.without(f"{LIBRARIES}/{name}")
                said = self.check_driver(exit_code=1)
                self.assertIn(f"/lib/x86_64-linux-gnu/{name} is missing", said)
                self.assertIn(f"libcuda.so.1 needs {name}, which is missing", said)
                self.doCleanups()

    def test_a_library_of_the_driver_alone_is_missed_too(self):
        odd = self.folder / "libodd.so.1"
        run("cc", "-shared", "-o", odd, f"-Wl,-soname,{odd.name}")
        run("cc", "-shared", "-o", self.folder / "libcuda.so.2", "-Wl,--no-as-needed", odd)
        said = run(ROOT / "docker/check-driver", self.root, self.folder / "libcuda.so.2",
                   exit_code=1)
        self.assertIn("libcuda.so.2 needs libodd.so.1, which is missing", said)

    def test_container_runtimes_find_where_to_mount_the_driver(self):
        # By this file the libraries lie where the image's loader looks without a cache.
        self.assertTrue((self.root / "etc/debian_version").is_file())
        self.assertEqual((self.root / "etc/ld.so.conf").read_text(),
                         "include /etc/ld.so.conf.d/*.conf\n")
        self.assertTrue((self.root / "etc/ld.so.conf.d").is_dir())
        cache = (self.root / "etc/ld.so.cache").read_bytes()
        self.assertIn(b"/lib/x86_64-linux-gnu/libdl.so.2\0", cache)
        self.assertNotIn(os.fsencode(self.root), cache)

    def test_its_sbom_names_grpc_and_no_open_vulnerability(self):
        sbom = self.root / "usr/share/meshsmooth/sbom.spdx"
        self.assertRegex(sbom.read_text(), "PackageSourceInfo: built from grpc ")
        self.assertIn("no open vulnerabilities", run(ROOT / "scripts/check-sbom", sbom))

    def test_serves_and_drains_under_chroot(self):
        if os.geteuid() != 0:
            self.skipTest("chroot needs root")
        archive = self.folder / "image.tar"
        run("tar", "-C", self.root, "-cf", archive, ".")
        said = run(ROOT / "docker/image-test", "--backend", "cpu", "--nodes", "3000", "--driver",
                   self.driver, archive, CLI, self.folder / "out")
        self.assertIn("ok: 3000 nodes smoothed on cpu, drained, exit code 0", said)

    def test_under_chroot_a_driver_that_misses_a_library_is_refused(self):
        if os.geteuid() != 0:
            self.skipTest("chroot needs root")
        self.without(f"{LIBRARIES}/libdl.so.2")
        archive = self.folder / "lacking.tar"
        run("tar", "-C", self.root, "-cf", archive, ".")
        said = run(ROOT / "docker/image-test", "--backend", "cpu", "--driver", self.driver, archive,
                   CLI, self.folder / "out", exit_code=1)
        self.assertIn("libcuda.so.1 needs libdl.so.2, which is missing", said)


if __name__ == "__main__":
    main()
