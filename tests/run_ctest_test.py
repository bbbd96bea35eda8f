"""A skip reaches ctest as a skip from every kind of test, and run_ctest.py reports it with its
reason; so it does a test that passes only in its second run."""

import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import test_main

TESTS = Path(__file__).parent

GTEST_OUTPUT = """[ RUN      ] Proxy.Waits
/src/proxy_test.cpp:105: Skipped
WARNING: haproxy is not installed

[  SKIPPED ] Proxy.Waits (0 ms)
"""

SCRIPTS = {
    "all_pass": """
class Some(unittest.TestCase):
    def test_a(self): pass
""",
    "one_skips": """
class Some(unittest.TestCase):
    def test_a(self): pass
    @unittest.skip("promtool is not installed")
    def test_b(self): pass
""",
    "class_skips": """
class Some(unittest.TestCase):
    @classmethod
    def setUpClass(cls): raise unittest.SkipTest("no Docker engine answers")
    def test_a(self): pass
""",
    "skips_and_fails": """
class Some(unittest.TestCase):
    @unittest.skip("promtool is not installed")
    def test_a(self): pass
    def test_b(self): self.fail("wrong")
""",
    "needs_peers": """
@test_main.needs_peers
class Some(unittest.TestCase):
    def test_a(self): pass
""",
    "empty": "",
}


class RunCtest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="meshsmooth-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def add_test(self, name, *command, properties=""):
        quoted = " ".join(f"[==[{part}]==]" for part in command)
        with open(self.folder / "CTestTestfile.cmake", "a") as file:
            file.write(f"add_test({name} {quoted})\n")
            if properties:
                file.write(f"set_tests_properties({name} PROPERTIES {properties})\n")

    def add_script(self, name):
        path = self.folder / f"{name}.py"
        path.write_text(f"import unittest\nimport test_main\n{SCRIPTS[name]}\ntest_main.main()\n")
        self.add_test(name, sys.executable, path, properties="SKIP_RETURN_CODE 77")

    def run_ctest(self, *arguments, exit_code=0, **environment):
        result = subprocess.run(
            [TESTS / "run_ctest.py", "--test-dir", self.folder, *arguments], text=True, timeout=120,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            env={**os.environ, "PYTHONPATH": str(TESTS / "support"), **environment})
        self.assertEqual(result.returncode, exit_code, result.stdout)
        return result.stdout

    def test_a_skip_of_every_runner_is_a_skip_with_its_reason(self):
        for name in ("all_pass", "one_skips", "class_skips"):
            self.add_script(name)
        self.add_test("echoed", "echo", "SKIPPED: shellcheck is not installed",
                      properties='SKIP_REGULAR_EXPRESSION "SKIPPED: "')
        self.add_test("googletest", "printf", "%s", GTEST_OUTPUT,
                      properties=r'SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\]"')
        self.add_test("wordless", "sh", "-c", "exit 77", properties="SKIP_RETURN_CODE 77")
        output = self.run_ctest()
        before, summary = output.split("100% tests passed, 0 tests failed out of 6\n")
        for name in ("one_skips", "class_skips", "echoed", "googletest", "wordless"):
            self.assertRegex(summary, rf"- {name} \(Skipped\)\n")
        self.assertNotIn("all_pass", summary)
        self.assertIn("SKIPPED: 5 tests", before)
        for reason, name in (("promtool is not installed", "one_skips"),
                             ("no Docker engine answers", "class_skips"),
                             ("shellcheck is not installed", "echoed"),
                             ("WARNING: haproxy is not installed", "googletest"),
                             ("no reason given", "wordless")):
            self.assertIn(f"  {reason}\n    1: {name}\n", before)

    def test_tests_with_one_reason_are_listed_together(self):
        for i in range(8):
            self.add_test(f"gpu{i}", "echo", "SKIPPED: no CUDA device",
                          properties='SKIP_REGULAR_EXPRESSION "SKIPPED: "')
        self.assertIn("  no CUDA device\n    8: gpu0, gpu1, gpu2, gpu3, gpu4 and 3 more\n",
                      self.run_ctest())

    def test_a_failure_beside_a_skip_is_a_failure(self):
        self.add_script("skips_and_fails")
        self.assertIn("0% tests passed, 1 tests failed out of 1", self.run_ctest(exit_code=8))

    def test_a_program_without_a_test_fails(self):
        self.add_script("empty")
        self.run_ctest(exit_code=8)

    def test_a_missing_program_is_a_failure(self):
        self.add_test("absent", self.folder / "absent")
        output = self.run_ctest(exit_code=8)
        self.assertNotIn("SKIPPED", output)
        self.assertIn("0% tests passed, 1 tests failed out of 1", output)

    def test_peers_are_tested_only_when_asked_for(self):
        self.add_script("needs_peers")
        self.assertIn("scripts/test --with-peers", self.run_ctest(MESHSMOOTH_WITH_PEERS=""))
        self.assertNotIn("SKIPPED", self.run_ctest(MESHSMOOTH_WITH_PEERS="1"))

    def test_a_test_that_passes_in_its_second_run_is_listed_as_flaky(self):
        self.add_test("flaky", "sh", "-c", f"! mkdir {self.folder}/seen 2>/dev/null")
        self.add_test("good", "true")
        output = self.run_ctest("--repeat", "until-pass:2")
        self.assertRegex(output, r"\nFLAKY: 1 tests .*\n  flaky\n\n100% tests passed, .* out of 2\n")

    def test_a_test_that_fails_twice_is_a_failure(self):
        self.add_test("bad", "false")
        output = self.run_ctest("--repeat", "until-pass:2", exit_code=8)
        self.assertNotIn("FLAKY", output)
        self.assertIn("0% tests passed, 1 tests failed out of 1", output)


if __name__ == "__main__":
    test_main.main()
