"""The table of options in docs/python.md, made of their declarations.

option_table.py    writes it; guide_test.py checks that it is current
"""

from __future__ import annotations

import pathlib
import re

from meshsmooth import _job_options

GUIDE = pathlib.Path(__file__).resolve().parents[3] / "docs" / "python.md"
NEEDLE = re.compile(r"(<!-- options of (\w+) -->\n).*?(?=<!-- end -->)", re.DOTALL)
OWN = {
    name: found
    for name, found in _job_options.MOVE_OPTIONS.items()
    if name not in _job_options.OPTIONS or name == "method"
}
TABLES = {"smooth": _job_options.OPTIONS, "move": OWN}


def table(options: _job_options.Declared) -> str:
    """Returns it as Markdown."""
    lines = ["| Keyword | Takes | Default | Meaning |", "| --- | --- | --- | --- |"]
    for name, (kind, option) in options.items():
        takes = _job_options.type_text(kind, option).replace("|", "\\|")
        unit = f"; {option.unit}" if option.unit else ""
        lines.append(f"| `{name}` | {takes}{unit} | {option.default} | {option.meaning} |")
    return "\n".join(lines) + "\n"


def current() -> str:
    """Returns the guide as it should be."""
    text = GUIDE.read_text(encoding="utf-8")
    return NEEDLE.sub(lambda found: found[1] + table(TABLES[found[2]]), text)


if __name__ == "__main__":
    GUIDE.write_text(current(), encoding="utf-8")
