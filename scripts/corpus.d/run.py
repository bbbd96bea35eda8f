"""Runs the driver over mesh files and tells how each one ended."""

import json
import pathlib
import subprocess
import tempfile
import threading

MEASURES = ["scaled_jacobian_min", "scaled_jacobian_mean", "mean_ratio_min", "mean_ratio_mean"]
SIGNALS_OF_LIMITS = {9: "hang", 24: "hang"}  # SIGKILL after the wall time, SIGXCPU


def run_driver(driver, rows, cache, jobs, progress=None, scratch=None, cpu_seconds=90):
    """Steps by file; `scratch` is a folder for results, by default in the cache."""
    steps = {row["file"]: [] for row in rows}
    ids = {str(number): row["file"] for number, row in enumerate(rows)}
    with tempfile.TemporaryDirectory(prefix="corpus-", dir=scratch or cache) as folder:
        with subprocess.Popen([driver, folder, str(jobs), str(cpu_seconds)], stdin=subprocess.PIPE,
                              stdout=subprocess.PIPE, text=True, encoding="ascii") as process:
            def feed():
                with process.stdin as pipe:
                    for number, file in ids.items():
                        pipe.write(f"{number}\t{cache / file}\n")

            feeder = threading.Thread(target=feed, daemon=True)
            feeder.start()
            for line in process.stdout:
                step = json.loads(line)
                steps[ids[step.pop("id")]].append(step)
                if progress and step["step"] == "end":
                    progress()
        if process.returncode != 0:
            raise SystemExit(f"corpus: the driver ended with {process.returncode}")
    return steps


def lower_measures(before, after):
    return [name for name in MEASURES
            if before.get(name) is not None and (after.get(name) is None
                                                 or after[name] < before[name] - 1e-6)]


def smoothings(steps):
    """(setting, its result) of a file; what a setting refused is left out."""
    named = {step["step"]: step for step in steps}
    found = [("defaults", named.get("smooth", {})), *named.get("settings", {}).items()]
    return [(name, run) for name, run in found if isinstance(run, dict) and "before" in run]


def lower_least(run):
    """The least values that are lower after smoothing."""
    return [name for name in lower_measures(run["before"], run) if name.endswith("_min")]


def outcome_of(steps):
    """{"outcome": …} and what belongs to it: `at` the step, `reason` and `error`, `lower` measures."""
    named = {step["step"]: step for step in steps}
    end = named.get("end", {"signal": 0, "exit": 1})
    failed = next((step for step in steps if "reason" in step), None)
    done = [step["step"] for step in steps if step["step"] != "end" and "reason" not in step]
    at = done[-1] if done else "start"
    if end["signal"]:
        kind = SIGNALS_OF_LIMITS.get(end["signal"], "crash")
        return {"outcome": kind, "at": at, "error": f"signal {end['signal']} after {at}"}
    if failed:
        result = {"at": failed["step"], "reason": failed["reason"], "error": failed["error"]}
        if failed["reason"] == "INTERNAL":
            return {"outcome": "internal", **result}
        # What the program wrote, the program must read.
        return {"outcome": "changed" if failed["step"] == "compare" else "refused", **result}
    if "compare" not in named or end["exit"]:
        return {"outcome": "crash", "at": at, "error": f"exit code {end['exit']} after {at}"}
    if not named["compare"]["only_coordinates"]:
        return {"outcome": "changed", "at": "compare", "error": named["compare"]["difference"]}
    before, after = named["smooth"]["before"], named["smooth"]
    if after["inverted"] > before["inverted"]:
        return {"outcome": "inverted", "at": "smooth",
                "error": f"{before['inverted']} inverted elements became {after['inverted']}"}
    if lower := lower_measures(before, after):
        return {"outcome": "worse", "lower": lower}
    return {"outcome": "ok"}


def make_outcomes(rows, steps):
    outcomes = []
    for row in rows:
        named = {step["step"]: step for step in steps[row["file"]]}
        counts = {key: named["read"][key] for key in ("nodes", "cells", "held")} \
            if "nodes" in named.get("read", {}) else None
        outcomes.append({**row, **outcome_of(steps[row["file"]]), "counts": counts,
                         "cpu_seconds": named.get("end", {}).get("cpu_seconds"),
                         "peak_mb": named.get("end", {}).get("peak_mb"),
                         "steps": steps[row["file"]]})
    return outcomes


def changed_since(old, outcomes):
    """Lines for the files whose outcome is another than in an earlier file of outcomes."""
    before = {row["file"]: row for row in json.loads(pathlib.Path(old).read_text())}
    lines = []
    for row in outcomes:
        was = before.get(row["file"])
        if was is None:
            lines.append(f"new      {row['outcome']:9} {row['file']}")
        elif (was["outcome"], was.get("reason")) != (row["outcome"], row.get("reason")):
            name = [" ".join(filter(None, (r["outcome"], r.get("reason")))) for r in (was, row)]
            lines.append(f"{name[0]} -> {name[1]}  {row['file']}"
                         + (f"\n         {row['error']}" if row.get("error") else ""))
    here = {row["file"] for row in outcomes}
    return lines + [f"gone     {file}" for file in before if file not in here]
