"""How a Python test program ends: a skip is not a pass. ctest takes exit code 77 for a skip, and
tests/run_ctest.py lists the reasons from the lines SKIPPED."""

import os
import sys
import unittest

SKIPPED = 77

# For tests that compare with heavy foreign programs, which a developer need not have.
needs_peers = unittest.skipUnless(os.environ.get("MESHSMOOTH_WITH_PEERS"),
                                  "foreign programs are tested by scripts/test --with-peers only")


def main(module="__main__", argv=None):
    """Runs the tests of a module, then exits: 0 when all passed, 77 when none failed and some were
    skipped, 1 otherwise."""
    arguments = sys.argv if argv is None else argv
    result = unittest.main(module, argv=[arguments[0], "-v", *arguments[1:]], exit=False).result
    for reason in sorted({reason for _, reason in result.skipped}):
        print(f"SKIPPED: {reason}", file=sys.stderr)
    if not result.wasSuccessful():
        sys.exit(1)
    if result.skipped:
        sys.exit(SKIPPED)
    if result.testsRun == 0:
        sys.exit("no test was run")
