#!/usr/bin/env python3
"""The programs have every command and flag that the documents use.

    commands_test.py MESHSMOOTH MESHSMOOTH_SERVER
"""

import functools
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"^```sh\n(.*?)^```", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"`([^`\n]+)`")
FLAG = re.compile(r"(?<![\w-])(--[a-z][a-z-]*)")


@functools.cache
def flags_of(*command):
    """None when there is no such command."""
    done = subprocess.run([*command, "--help"], capture_output=True, text=True, timeout=60)
    return set(FLAG.findall(done.stdout)) if done.returncode == 0 else None


def commands_in(text):
    """What follows the name of a program, up to the end of its command."""
    blocks = BLOCK.findall(text)
    pieces = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    pieces += INLINE.findall(BLOCK.sub("", text))
    for piece in pieces:
        for part in re.split(r"[;|&#]", piece.partition(" # ")[0]):
            match = re.match(r"\s*(?:\S*/)?(meshsmooth(?:-server)?) +(.*)", part)
            if match:
                yield match[1], match[2]


def main():
    programs = {"meshsmooth": sys.argv[1], "meshsmooth-server": sys.argv[2]}
    problems, count = [], 0
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "examples").glob("*.md")]
    for page in pages:
        for program, rest in commands_in(page.read_text(encoding="utf-8")):
            command = [programs[program]]
            if program == "meshsmooth" and not rest.startswith("-"):
                name, *words = rest.split()
                if not re.fullmatch("[a-z]+", name):
                    continue
                command.append(name)
                if name == "generate" and words and re.fullmatch("[a-z-]+", words[0]):
                    command.append(words[0])  # each shape has its own flags
            known = flags_of(*command)
            count += 1
            if known is None:
                problems.append(f"{page.relative_to(ROOT)}: there is no command: {program} {rest}")
                continue
            problems += [f"{page.relative_to(ROOT)}: there is no {flag}: {program} {rest}"
                         for flag in FLAG.findall(rest) if flag not in known]
    if count < 30:
        problems.append(f"only {count} commands found in the documents")
    print(f"{count} commands")
    sys.exit("\n".join(problems) or None)


if __name__ == "__main__":
    main()
