"""scripts/sign: what it signs is verified by minisign and sha256sum, and nothing else is."""

import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import test_main

ROOT = Path(__file__).parents[1]


def run(*command, cwd=None):
    return subprocess.run(list(map(str, command)), cwd=cwd, capture_output=True, text=True,
                          stdin=subprocess.DEVNULL)


@unittest.skipUnless(shutil.which("minisign"), "minisign is not installed")
class Sign(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="meshsmooth-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.release = self.folder / "release"
        (self.release / "part").mkdir(parents=True)
        (self.release / "a.deb").write_text("a")
        (self.release / "part" / "images.txt").write_text("sha256:0")
        self.key = self.make_key("key")

    def make_key(self, name):
        """A throw-away key without a password."""
        key = self.folder / name
        made = run("minisign", "-G", "-W", "-s", key, "-p", f"{key}.pub")
        self.assertEqual(made.returncode, 0, made.stderr)
        return key

    def sign(self, *key):
        return run(ROOT / "scripts" / "sign", self.release, *key)

    def verifies(self, key):
        signature = run("minisign", "-V", "-p", f"{key}.pub", "-m", "SHA256SUMS", cwd=self.release)
        sums = run("sha256sum", "--check", "--strict", "SHA256SUMS", cwd=self.release)
        return signature.returncode == 0 and sums.returncode == 0

    def test_what_is_signed_verifies(self):
        signed = self.sign(self.key)
        self.assertEqual(signed.returncode, 0, signed.stderr)
        self.assertTrue(self.verifies(self.key))
        sums = (self.release / "SHA256SUMS").read_text()
        self.assertEqual([line.split("  ")[1] for line in sums.splitlines()],
                         ["a.deb", "part/images.txt"])

    def test_what_was_changed_does_not(self):
        for name in "a.deb", "part/images.txt", "SHA256SUMS":
            with self.subTest(name):
                self.sign(self.key)
                with (self.release / name).open("a") as file:
                    file.write("x")
                self.assertFalse(self.verifies(self.key))

    def test_another_key_does_not_verify_it(self):
        self.sign(self.key)
        self.assertFalse(self.verifies(self.make_key("other")))

    def test_without_a_key_no_old_signature_is_left(self):
        self.sign(self.key)
        self.assertEqual(self.sign().returncode, 0)
        self.assertEqual(sorted(path.name for path in self.release.glob("SHA*")), ["SHA256SUMS"])

    def test_a_missing_key_and_one_among_the_files_are_named(self):
        missing = self.sign(self.folder / "nosuch")
        self.assertNotEqual(missing.returncode, 0)
        self.assertIn("nosuch", missing.stderr)
        shutil.copy(self.key, self.release / "key")
        inside = self.sign(self.release / "key")
        self.assertNotEqual(inside.returncode, 0)
        self.assertIn("lies in what it is to sign", inside.stderr)
        self.assertFalse((self.release / "SHA256SUMS").exists())

    def test_an_empty_folder_is_an_error(self):
        shutil.rmtree(self.release)
        self.release.mkdir()
        self.assertNotEqual(self.sign(self.key).returncode, 0)


if __name__ == "__main__":
    test_main.main()
