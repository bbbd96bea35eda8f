"""The Debian packages of this build: what they hold, lintian's opinion, and that packing twice gives
the same bytes, all by scripts/packages."""

import os
import subprocess
import tempfile
import unittest
from pathlib import Path

from test_main import main, needs_peers

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["MESHSMOOTH_BUILD"])
HAS_CUDA = (BUILD / "core/CMakeFiles/meshsmooth_cuda_optimize.dir").exists()
HELD = {
    "meshsmooth": [
        "usr/bin/meshsmooth", "usr/bin/meshsmooth-gateway", "usr/share/man/man1/meshsmooth-smooth.1.gz",
        "usr/share/bash-completion/completions/meshsmooth",
        "usr/share/zsh/vendor-completions/_meshsmooth",
        "usr/share/fish/vendor_completions.d/meshsmooth.fish"],
    "meshsmooth-server": [
        "usr/bin/meshsmooth-server", "usr/share/man/man8/meshsmooth-server.8.gz",
        "usr/lib/systemd/system/meshsmooth-server.service", "etc/meshsmooth/server.toml"],
    "libmeshsmooth-dev": [
        "usr/include/meshsmooth/client.hpp", "usr/include/meshsmooth-wire/wire/codec.hpp",
        "usr/include/meshsmooth/v1/smoothing.pb.h", "usr/share/meshsmooth/v1/smoothing.proto"],
}
COMMON = ["copyright", "changelog.gz", "changelog.Debian.gz"]


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True,
                          timeout=1200)
    if done.returncode != 0:
        raise AssertionError(f"{command}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


@needs_peers
@unittest.skipIf(HAS_CUDA, "packages are without CUDA, which this build has")
class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="meshsmooth-packages-")
        cls.addClassCleanup(cls.folder.cleanup)
        out = Path(cls.folder.name) / "packages"
        run(ROOT / "scripts/packages", "--build", BUILD, "--out", out)  # twice, and by lintian
        cls.packages = {file.name.split("_")[0]: file for file in out.glob("*.deb")}

    def test_there_are_three_and_each_holds_its_files(self):
        self.assertEqual(set(self.packages), set(HELD))
        for name, package in self.packages.items():
            held = {line.split()[5].removeprefix("./"): line.split()
                    for line in run("dpkg-deb", "--contents", package).splitlines()}
            for file in HELD[name] + [f"usr/share/doc/{name}/{file}" for file in COMMON]:
                self.assertIn(file, held)
            for file, line in held.items():
                self.assertEqual(line[1], "root/root", file)
                allowed = "-rwxr-xr-x" if file.startswith("usr/bin/") and not file.endswith("/") \
                    else "drwxr-xr-x" if file.endswith("/") else "-rw-r--r--"
                self.assertEqual(line[0], allowed, file)

    def test_programs_depend_on_what_they_load(self):
        for name in ("meshsmooth", "meshsmooth-server"):
            depends = run("dpkg-deb", "--field", self.packages[name], "Depends")
            self.assertIn("libc6 (>=", depends)
            self.assertIn("libtbb12", depends)
        self.assertIn("libgrpc++-dev", run("dpkg-deb", "--field",
                                           self.packages["libmeshsmooth-dev"], "Depends"))

    def test_sums_are_those_of_the_files_and_programs_are_stripped(self):
        for name, package in self.packages.items():
            tree = Path(self.folder.name) / name
            run("dpkg-deb", "--raw-extract", package, tree)
            sums = tree / "DEBIAN/md5sums"
            subprocess.run(["md5sum", "--quiet", "--check", sums], cwd=tree, check=True)
            files = sum(file.is_file() for file in tree.glob("usr/**/*"))
            self.assertEqual(len([line for line in sums.read_text().splitlines()
                                  if "  usr/" in line]), files)
            for program in tree.glob("usr/bin/*"):
                self.assertNotIn(".symtab", run("readelf", "--sections", "--wide", program))

    def test_the_server_has_its_configuration_and_its_scripts(self):
        tree = Path(self.folder.name) / "control"
        run("dpkg-deb", "--control", self.packages["meshsmooth-server"], tree)
        self.assertEqual((tree / "conffiles").read_text(), "/etc/meshsmooth/server.toml\n")
        for script in ("postinst", "prerm", "postrm"):
            run("sh", "-n", tree / script)
            self.assertTrue(os.access(tree / script, os.X_OK))


if __name__ == "__main__":
    main()
