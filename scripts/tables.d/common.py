"""What all tables need: the declaration, and how C++, Python and Markdown write rows."""

import json
import pathlib
import re
import textwrap
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
NOTE = "Made by scripts/tables from proto/declaration; do not edit."


class Failure(Exception):
    """What is wrong with the declaration or a document, in one line."""


def declared(name):
    return tomllib.loads((ROOT / f"proto/declaration/{name}.toml").read_text(encoding="utf-8"))


def quoted(text):
    return json.dumps(text, ensure_ascii=False)


def interval(of, whole=False):
    """The range of a number: C++ initializer, in words for errors, in short for helps, condition on other fields."""
    found = re.fullmatch(r"([\[(])(\S+), (\S+)([\])])", of["range"])
    if not found:
        raise Failure(f"{of['range']} is not an interval")
    opening, lower, upper, closing = found.groups()
    if upper.startswith("-"):  # another field
        words = f"minus {upper[1:]}"
        return "", f"finite and below {words}", f"below {words}", upper
    parts = [f".lower = {lower}"] + ([f".upper = {upper}"] if upper != "inf" else [])
    parts += [".lower_included = false"] * (opening == "(") + [".upper_included = false"] * (closing == ")" and upper != "inf")
    if upper == "inf":
        words = f"{lower} or more" if opening == "[" else f"above {lower}"
        return ", ".join(parts), words if whole else f"finite and {words}", words, None
    words = f"from {lower} to {upper}"
    if (opening, closing) != ("[", "]"):
        words = (f"{lower} or more" if opening == "[" else f"above {lower}") + " and " + (
            f"at most {upper}" if closing == "]" else f"below {upper}")
    return ", ".join(parts), words, of["range"], None


def cpp_table(*parts):
    return f"// {NOTE}\n// clang-format off\n" + "".join(parts)


def cpp_header(namespace, includes, *parts):
    return (f"#pragma once\n\n// {NOTE}\n// clang-format off\n\n{includes}\nnamespace {namespace} {{\n\n" +
            "".join(parts) + f"}}  // namespace {namespace}\n")


def cpp_array(of, name, rows):
    return f"constexpr {of} {name}[] = {{\n" + "".join(f"    {row},\n" for row in rows) + "};\n"


def cpp_comment(text, indent=""):
    """A comment before what it explains; lines are kept if the text has several."""
    text = text.strip("\n")
    lines = text.split("\n") if "\n" in text else textwrap.wrap(text, 96 - len(indent))
    return "".join(f"{indent}/// {line}".rstrip() + "\n" for line in lines)


def cpp_member(text, doc, indent="  "):
    """A line with its comment behind it, or before it where that is too long."""
    line = f"{indent}{text}  ///< {doc}"
    if "\n" in doc or len(line) > 100:
        return cpp_comment(doc, indent) + f"{indent}{text}\n"
    return line + "\n"


def python_tuple(rows):
    return "(\n" + "".join(f"    {row},\n" for row in rows) + ")\n"


def python_module(doc, *parts):
    return (f'"""{doc}\n\n{NOTE}\n"""\n# fmt: off\n# ruff: noqa: E501\n\n' +
            "from __future__ import annotations\n\n" + "".join(parts))


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(cell or "–" for cell in line) + " |\n" for line in lines)


def snake(name):
    return "".join("_" + c.lower() if c.isupper() else c for c in name).lstrip("_")


def camel(name):
    return "".join(part.title() for part in name.split("_"))
