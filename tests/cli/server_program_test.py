"""meshsmooth-server as a program: its settings."""

import os
import subprocess

from programs import DONE, SERVER, USAGE, CliTest, main


class Settings(CliTest):
    def run_server(self, *arguments, exit_code=DONE, **environment):
        result = subprocess.run([SERVER, *arguments], capture_output=True, text=True, timeout=60,
                                env={**os.environ, **environment})
        self.assertEqual(result.returncode, exit_code, result.stderr)
        return result

    def test_prints_what_it_reads(self):
        printed = self.run_server("--print-config", "--lanes", "3", "--max-job-bytes", "1GiB",
                                  MESHSMOOTH_MAX_QUEUED_JOBS="7").stdout
        self.assertIn("lanes = 3\n", printed)
        self.assertIn(f"max-job-bytes = {2**30}\n", printed)
        self.assertIn("max-queued-jobs = 7\n", printed)

        (self.folder / "server.toml").write_text(printed)
        again = self.run_server("--print-config", "--config", self.path("server.toml")).stdout
        self.assertEqual(again, printed)
        again = self.run_server("--print-config", MESHSMOOTH_CONFIG=self.path("server.toml")).stdout
        self.assertEqual(again, printed)

    def test_wrong_values_end_with_field_value_source_and_exit_code(self):
        (self.folder / "server.toml").write_text("lanes = many\n")
        cases = [
            (["--lanes", "many"], {}, "flag --lanes"),
            ([], {"MESHSMOOTH_LANES": "many"}, "environment, MESHSMOOTH_LANES"),
            (["--config", self.path("server.toml")], {}, "line 1"),
        ]
        for arguments, environment, source in cases:
            with self.subTest(source):
                error = self.run_server(*arguments, exit_code=USAGE, **environment).stderr
                for part in ("lanes: ", '"many"', source):
                    self.assertIn(part, error)
                self.assertEqual(error.count("\n"), 1)

    def test_unknown_settings_are_errors(self):
        (self.folder / "server.toml").write_text("lanse = 2\n")
        error = self.run_server("--config", self.path("server.toml"), exit_code=USAGE).stderr
        self.assertIn("lanse", error)
        self.run_server("--lanse", "2", exit_code=USAGE)

    def test_an_address_in_use_is_named(self):
        error = self.run_server("--listen", "203.0.113.1:1", "--log-level", "off",
                                exit_code=USAGE).stderr
        self.assertIn("listen", error)
        self.assertIn("203.0.113.1:1", error)


if __name__ == "__main__":
    main()
