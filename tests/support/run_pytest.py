"""Runs a file of pytest's tests for ctest: a skip is not a pass.

    run_pytest.py FILE [PYTEST_ARGUMENT…]

Exit code 0 when all passed, 77 when none failed and some were skipped, 1 otherwise. The reasons
are listed in lines SKIPPED, from which tests/run_ctest.py takes them."""

import importlib.util
import sys

from test_main import SKIPPED

NEEDED = {"pytest": "python3-pytest", "hypothesis": "python3-hypothesis", "grpc": "python3-grpcio",
          "google.protobuf": "python3-protobuf", "numpy": "python3-numpy"}


def is_installed(module):
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:  # of its package
        return False


class Skips:
    """Collects why tests were skipped."""

    def __init__(self):
        self.reasons = set()

    def pytest_runtest_logreport(self, report):
        self.note(report)

    def pytest_collectreport(self, report):
        self.note(report)

    def note(self, report):
        if report.skipped and not hasattr(report, "wasxfail"):
            self.reasons.add(report.longrepr[2].removeprefix("Skipped: "))


def main(arguments):
    missing = [package for module, package in NEEDED.items() if not is_installed(module)]
    if missing:
        print(f"SKIPPED: not installed: {', '.join(missing)}")
        return SKIPPED
    import pytest  # only here: it may be missing

    skips = Skips()
    code = pytest.main(["-v", "-p", "no:cacheprovider", *arguments], plugins=[skips])
    for reason in sorted(skips.reasons):
        print(f"SKIPPED: {reason}")
    nothing_ran = code == pytest.ExitCode.NO_TESTS_COLLECTED
    if code != pytest.ExitCode.OK and not (nothing_ran and skips.reasons):
        return 1
    return SKIPPED if skips.reasons else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
