#!/usr/bin/env python3
"""No source, proto or document has a retired word: those of words.txt, where words_allowed.txt has
no exception.

    tests/words_test.py            fails with each place and what to write instead
    tests/words_test.py --all      also lists the places that words_allowed.txt allows
"""

import collections
import fnmatch
import pathlib
import re
import sys

TESTS = pathlib.Path(__file__).resolve().parent
ROOT = TESTS.parent
FOLDERS = (".ci", ".github", "client", "cmake", "core", "deploy", "docker", "docs", "examples", "proto",
           "scripts", "server", "tests")
SKIPPED = ("tests/words.txt", "tests/words_allowed.txt", "tests/fuzz/corpus/", "tests/wire/recorded/",
           "tests/corpus/files/", "tests/corpus/expected.json")
BINARY = {".png", ".svg", ".pyc"}


def lines_of(name):
    for line in (TESTS / name).read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            yield line


def word_pattern(word):
    """In prose, and as the part of an identifier in snake_case, CamelCase or capitals."""
    if word.startswith("/"):
        return word[1:-1]
    parts = word.split(" ") if " " in word else re.findall(r"[A-Z]?[a-z]+", word)
    gap = r"(?:[\s_-]|//|\*)+"
    lower = gap.join(part.lower() for part in parts)
    title = f"(?:{gap})?".join(part.capitalize() for part in parts)
    mixed = parts[0].lower() + "".join(part.capitalize() for part in parts[1:])
    starts = [f"(?<![A-Za-z]){lower}", title, f"(?<![A-Z]){gap.join(part.upper() for part in parts)}(?![A-Z])"]
    if len(parts) > 1:
        starts += [f"(?<![A-Za-z]){mixed}", f"(?<![A-Za-z]){parts[0].capitalize()}{gap}" +
                   gap.join(part.lower() for part in parts[1:])]
    return f"(?:{'|'.join(starts)})(?![a-z])"


def parts_of(text):
    """The words in it and in its identifiers, in small letters."""
    parts = set()
    for word in set(re.findall(r"[A-Za-z]+", text)):
        parts.update(part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", word))
    return parts


def read_words():
    """[(word, the parts that a text must have for it, pattern, instead, unless)]"""
    words = []
    for line in lines_of("words.txt"):
        left, instead = line.split(" => ", 1)
        instead, _, unless = instead.partition(" unless ")
        for name in [left] if left.startswith("/") else left.split(", "):
            keys = [] if name.startswith("/") else re.findall(r"[A-Z]?[a-z]+", name)
            words.append((name, {key.lower() for key in keys}, re.compile(word_pattern(name)), instead,
                          re.compile(unless) if unless else None))
    return words


def files():
    for path in sorted(ROOT.iterdir()):
        if path.is_file() and path.name != "LICENSE":
            yield path
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            name = path.relative_to(ROOT).as_posix()
            if (path.is_file() and path.suffix not in BINARY and not name.startswith(SKIPPED)
                    and "__pycache__" not in name):
                yield path


def main():
    words = read_words()
    allowed = [(rule.split()[0], rule.split()[1:]) for rule in lines_of("words_allowed.txt")]
    used, found, forgiven, file_count = set(), [], collections.Counter(), 0
    for path in files():
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        file_count += 1
        name = path.relative_to(ROOT).as_posix()
        rules = [rule for rule in enumerate(allowed) if fnmatch.fnmatch(name, rule[1][0])]
        parts = parts_of(text)
        matches = [(match, word) for word in words if word[1] <= parts
                   for match in word[2].finditer(text)]
        for match, (word, _, _, instead, unless) in sorted(matches, key=lambda m: m[0].start()):
            start = text.rfind("\n", 0, match.start()) + 1
            end = text.find("\n", match.end())
            if unless and unless.search(f"{name}: {text[start:end if end >= 0 else None]}"):
                continue
            rule = next((i for i, (_, its) in rules if "*" in its or word in its), None)
            if rule is not None:
                used.add(rule)
                forgiven[allowed[rule][0]] += 1
                if "--all" not in sys.argv:
                    continue
            shown = " ".join(match[0].split())
            found.append(f"{name}:{text.count(chr(10), 0, match.start()) + 1}: {shown}: write {instead}")
    for i, (glob, its) in enumerate(allowed):
        if i not in used:
            found.append(f"tests/words_allowed.txt: {glob} {' '.join(its)} allows nothing; remove it")
    if file_count < 300:
        found.append(f"only {file_count} files found under {ROOT}")
    print(f"{file_count} files, {sum(forgiven.values())} exceptions:",
          ", ".join(f"{glob} {count}" for glob, count in sorted(forgiven.items())))
    if found:
        sys.exit("\n".join(found))


if __name__ == "__main__":
    main()
