"""The tables of outcomes: on the terminal and in docs/results/corpus.json."""

import collections
import json
import re
import subprocess

from gather import HERE
from refusals import Kinds, normalize
from run import MEASURES, lower_least, lower_measures, smoothings

ROOT = HERE.parent.parent
BAD = ["crash", "hang", "internal", "changed", "inverted"]
ORDER = ["ok", "worse", "refused", *BAD]
GROUPS = {"bdf": ".bdf .nas", "nas": ".bdf .nas", "exo": ".exo .e .g .ex2", "e": ".exo .e .g .ex2",
          "g": ".exo .e .g .ex2", "ex2": ".exo .e .g .ex2", "mesh": ".mesh .meshb", "meshb": ".mesh .meshb",
          "node": ".node .ele", "foam": "OpenFOAM"}
# VTK's numbers of what has no surface or volume of its own.
BELOW_2 = {"0", "1", "2", "3", "4", "21", "35", "68"}


def group_of(row):
    return GROUPS.get(row["format"], "." + row["format"])


def own_counts(row):
    """Nodes, and cells of two or three dimensions by VTK's number. Types that only the format knows are
    left out: no peer has them."""
    same = {"8": "9", "11": "12"}
    cells = collections.Counter()
    for kind, number in row["counts"]["cells"].items():
        if kind.isdigit() and kind not in BELOW_2:
            cells[same.get(kind, kind)] += number
    return row["counts"]["nodes"], dict(cells)


def difference_of(row, peer):
    """What a peer counts otherwise, or nothing."""
    nodes, cells = own_counts(row)
    texts = []
    if row["format"] != "obj" and nodes != peer["nodes"]:  # VTK doubles nodes with two texture points
        texts.append(f"nodes {nodes}, {peer['peer']} {peer['nodes']}")
    for kind in sorted(set(cells) | set(peer["cells"]), key=int):
        if cells.get(kind, 0) != peer["cells"].get(kind, 0):
            texts.append(f"cells of type {kind} {cells.get(kind, 0)}, {peer['peer']} "
                         f"{peer['cells'].get(kind, 0)}")
    return "; ".join(texts)


def add_explanations(outcomes, counts):
    """Adds to each file: the kind of its refusal, what a peer counts, what differs."""
    kinds = Kinds()
    explained = json.loads((HERE / "counts.json").read_text())["explained"]
    for row in outcomes:
        if row["outcome"] == "refused":
            kind = kinds.find(row)
            row["kind"] = kind["name"] if kind else None
        peer = counts.get(row["sha256"], {})
        if row["counts"] is None or "cells" not in peer:
            continue
        row["peer"] = peer
        row["differs"] = difference_of(row, peer)
        if row["differs"]:
            why = next((entry["why"] for entry in explained
                        if re.search(entry["file"], row["file"])
                        and re.search(entry.get("differs", ""), row["differs"])), None)
            row["differs_because"] = why


def faults(outcomes):
    """Lines on what must not be."""
    lines = []
    for row in outcomes:
        if row["outcome"] in BAD:
            lines.append(f"{row['outcome']}: {row['file']}: {row['error']}")
        if row["outcome"] == "refused" and row["kind"] is None:
            lines.append(f"unexplained refusal: {row['file']}: {row['error']}")
        if row.get("differs") and not row["differs_because"]:
            lines.append(f"count differs: {row['file']}: {row['differs']}")
        for setting, run in smoothings(row["steps"]):
            if (lower := lower_least(run)) and not run["said"]:
                lines.append(f"worse, not said: {row['file']}, {setting}: {', '.join(lower)}")
    return lines


def outcome_rows(outcomes):
    groups = collections.defaultdict(list)
    for row in outcomes:
        groups[group_of(row)].append(row)
    table = []
    for name, rows in sorted(groups.items(), key=lambda item: -len(item[1])) + [("all", outcomes)]:
        of = collections.Counter(row["outcome"] for row in rows)
        counted = [row for row in rows if "peer" in row]
        table.append([name, len(rows), *(of[outcome] for outcome in ORDER),
                      sum(1 for row in rows if row["outcome"] == "refused" and row["kind"] is None),
                      len(counted), sum(1 for row in counted if not row["differs"]),
                      sum(1 for row in counted if row["differs"] and row["differs_because"])])
    return table


SETTING_COLUMNS = ["Setting", "Files", "Nodes went back", "A least value lower, said", "Not said", "All lower"]


def setting_rows(outcomes):
    """By setting: files smoothed, those where nodes went back so that they are not worse, those where the
    least mean ratio or scaled Jacobian is lower, and those where both of these and both means are."""
    counted = collections.defaultdict(collections.Counter)
    for row in outcomes:
        for setting, run in smoothings(row["steps"]):
            of = counted[setting]
            of["files"] += 1
            of["back"] += run["restored"] > 0
            if lower_least(run):
                of["said" if run["said"] else "unsaid"] += 1
            of["all"] += len(lower_measures(run["before"], run)) == len(MEASURES)
    return [[setting, *(of[name] for name in ("files", "back", "said", "unsaid", "all"))]
            for setting, of in counted.items()]


COLUMNS = ["Format", "Files", *(name.capitalize() for name in ORDER), "Unexplained", "Counted by a peer", "Same counts",
           "Explained difference"]


def kind_rows(outcomes):
    counted = collections.Counter(row["kind"] for row in outcomes if row["outcome"] == "refused")
    return [[kind["name"], kind["reason"], counted[kind["name"]], kind["why"]]
            for kind in sorted(Kinds().kinds, key=lambda kind: -counted[kind["name"]])
            if counted[kind["name"]]]


def source_rows(outcomes):
    counted = collections.Counter(row["source"] for row in outcomes)
    return [[name, number] for name, number in counted.most_common()]


def aligned(columns, rows):
    table = [[str(cell) for cell in row] for row in [columns, *rows]]
    widths = [max(len(row[n]) for row in table) for n in range(len(columns))]
    return "\n".join("  ".join(cell.ljust(width) if n == 0 else cell.rjust(width)
                               for n, (cell, width) in enumerate(zip(row, widths))).rstrip()
                     for row in table)


def text_of(outcomes, missing):
    parts = [aligned(COLUMNS, outcome_rows(outcomes)), aligned(SETTING_COLUMNS, setting_rows(outcomes)), "Refusals of accepted kinds:",
             "\n".join(f"{row[2]:5}  {row[1]:22} {row[0]}" for row in kind_rows(outcomes)) or "none"]
    unexplained = collections.Counter(
        f"{row['reason']:22} {row['at']:8} {normalize(row)}" for row in outcomes
        if row["outcome"] == "refused" and row["kind"] is None)
    if unexplained:
        parts += ["Unexplained refusals, by normalized text:",
                  "\n".join(f"{number:5}  {text}" for text, number in unexplained.most_common())]
    other = [line for line in faults(outcomes) if not line.startswith("unexplained")]
    parts.append("\n".join(other) if other else "no crash, hang, internal error, change or count that differs")
    if missing:
        parts.append("Not available: " + ", ".join(missing))
    return "\n\n".join(parts)


def record(outcomes, missing, machine, date):
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True,
                            cwd=ROOT, check=True).stdout.strip()
    notes = "Outcomes and counts as scripts/corpus --help describes them."
    if missing:
        notes += " Sources that were not available: " + ", ".join(missing) + "."
    result = {
        "title": "Mesh files of other programs", "machine": machine,
        "command": "scripts/corpus --record", "date": date, "commit": commit,
        "recorded": {"commit": commit, "date": date}, "notes": notes,
        "tables": {
            "outcomes": {"caption": "Outcomes by format.", "columns": COLUMNS,
                         "rows": [[cell if isinstance(cell, str) else cell for cell in row]
                                  for row in outcome_rows(outcomes)]},
            "settings": {"caption": "What smoothing made worse, by setting.", "columns": SETTING_COLUMNS,
                         "rows": setting_rows(outcomes)},
            "refusals": {"caption": "Refused files by the accepted kind.",
                         "columns": ["Kind", "Reason", "Files", "Why a user would accept it"],
                         "rows": [[row[0], f"`{row[1]}`", *row[2:]] for row in kind_rows(outcomes)]},
            "sources": {"caption": "Files by source.", "columns": ["Source", "Files"],
                        "rows": source_rows(outcomes)},
        },
    }
    path = ROOT / "docs" / "results" / "corpus.json"
    path.write_text(json.dumps(result, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
