"""The accepted kinds of refusals (refusals.json): why a user of the format would accept each."""

import json
import re

from gather import HERE


def without_path(row):
    """An error without the path of its file, which may have any word in it."""
    text = row["error"]
    for name in (row["file"], row["file"].rsplit("/", 1)[-1]):
        text = text.replace(name, "FILE")
    return re.sub(r"\S*/FILE", "FILE", text)


def normalize(row):
    """An error without what differs from file to file: paths, numbers, quoted text."""
    text = without_path(row)
    text = re.sub(r"\S*/\S*", "PATH", text)
    text = re.sub(r'"[^"]*"', '"…"', text)
    return re.sub(r"\d+(\.\d+)?([eE][-+]?\d+)?", "N", text)


class Kinds:
    def __init__(self):
        self.kinds = json.loads((HERE / "refusals.json").read_text())["kinds"]

    def find(self, row):
        """The kind that explains a refused file, or None."""
        for kind in self.kinds:
            if kind["reason"] != row["reason"]:
                continue
            if "formats" in kind and row["format"] not in kind["formats"]:
                continue
            if "step" in kind and kind["step"] != row["at"]:
                continue
            if "sources" in kind and row["source"] not in kind["sources"]:
                continue
            if re.search(kind.get("text", ""), without_path(row)):
                return kind
        return None
