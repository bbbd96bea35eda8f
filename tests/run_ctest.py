#!/usr/bin/env python3
"""Runs ctest and reports what its summary leaves out: why tests were skipped, and which of them
passed only when they were run again (--repeat until-pass:N).

    run_ctest.py CTEST_ARGUMENT…

Both lists come before ctest's own summary, which closes the output. The exit code is ctest's."""

import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections import defaultdict
from pathlib import Path

# "12/90 Test #7: a.name ......***Failed    0.02 sec"; a repeated test has no "12/90" at first.
RESULT = re.compile(r"^\s*(?:\d+/\d+ )?\s*Test\s+#\d+: (\S+) \.*(?:\s+|\*\*\*)(\w[^\d]*?)\s+[\d.]+ sec")
SUMMARY = re.compile(r"^\d+% tests passed, ")
NAMES_SHOWN = 5


def reasons(output):
    """Why a test was skipped, from its output."""
    # tests/support/test_main.py and tests that only `echo SKIPPED: …`.
    found = re.findall(r"^SKIPPED: (.*)", output, re.M)
    # GoogleTest: "file.cpp:12: Skipped", then the message up to an empty line.
    found += [" ".join(text.split()) for text in
              re.findall(r"^\S+:\d+: Skipped\n(.*?)\n(?=\n|\[)", output, re.M | re.S)]
    return sorted(set(found)) or ["no reason given"]


def skipped_tests(report):
    """Reason → names of the tests, of ctest's report in JUnit's format."""
    by_reason = defaultdict(list)
    for case in ElementTree.parse(report).getroot().iter("testcase"):
        skipped = case.find("skipped")
        # A test whose program is missing did not run either, but has failed.
        if skipped is None or not (skipped.get("message") or "").startswith("SKIP_"):
            continue
        for reason in reasons(case.findtext("system-out") or ""):
            by_reason[reason].append(case.get("name"))
    return by_reason


def names_of(tests):
    shown = ", ".join(tests[:NAMES_SHOWN])
    return shown + (f" and {len(tests) - NAMES_SHOWN} more" if len(tests) > NAMES_SHOWN else "")


def main(arguments):
    failed, passed, summary = set(), set(), []
    with tempfile.TemporaryDirectory(prefix="meshsmooth-") as folder:
        report = Path(folder) / "report.xml"
        ctest = subprocess.Popen(["ctest", *arguments, "--output-junit", report],
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                 errors="replace")
        for line in ctest.stdout:
            if summary or SUMMARY.match(line):
                summary.append(line)
                continue
            print(line, end="", flush=True)
            if match := RESULT.match(line):
                (passed if match.group(2) == "Passed" else failed).add(match.group(1))
        code = ctest.wait()
        by_reason = skipped_tests(report) if report.exists() else {}

    if by_reason:
        count = len({name for names in by_reason.values() for name in names})
        print(f"\nSKIPPED: {count} tests were skipped, in whole or in part")
        for reason, names in sorted(by_reason.items(), key=lambda item: (-len(item[1]), item[0])):
            print(f"  {reason}\n    {len(names)}: {names_of(names)}")
    if flaky := sorted(failed & passed):
        print(f"\nFLAKY: {len(flaky)} tests failed at first and passed when they were run again")
        for name in flaky:
            print(f"  {name}")
    print()
    print("".join(summary), end="", flush=True)
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
