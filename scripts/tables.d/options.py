"""Options of a job: ranges and fields for C++, flags of the command line, Python's keywords, a table of documents."""

import textwrap

import enums
import methods
from common import Failure, cpp_header, declared, interval, python_module, quoted, snake, table

PYTHON = {"bool": "bool", "int": "int", "number": "float", "seconds": "Duration", "text": "str"}
TAKES_SECONDS = "seconds, text or timedelta"
HEADER_INCLUDES = """#include <array>
#include <string_view>
#include <tuple>

#include "meshsmooth/method_field.hpp"
#include "meshsmooth/options.hpp"
"""
HEADER_TYPES = """\
/// The range of a number among the options.
struct OptionRange {
  Range range;
  std::string_view text;  // "from 1 to 90 degrees"
};

/// A member of `SmoothOptions` that the wire has as it is.
template <class Value>
struct OptionField {
  std::string_view name;  // in meshsmooth.v1.SmoothingOptions
  Value SmoothOptions::*member;
  std::string_view noun;  // of its values
};

"""
FLAG_TYPE = """\
/// A flag of the command line.
struct Flag {
  const char* name;
  const char* help;
};

"""
PYTHON_IMPORTS = """\
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Literal, TypedDict

from ._methods import (
    Backend,
    Boundary,
    Detail,
    Form,
    Goal,
    Method,
    MethodName,
    Metric,
    Priority,
    Tangled,
    Target,
)
from ._option import Duration, Nodes, Numbers, Option, Vectors
from ._progress import Progress


"""
SMOOTH_DOC = """The keywords of `smooth` and of whatever else starts a job.

    Durations are seconds, text as in "500ms", "30s", "10min", or a `timedelta`. A mask of nodes
    has the type bool; indices count from 0; a name is that of a node array (not 0: chosen) or set.
    """


def literal_names():
    return {name: of["python"] for name, of in declared("enums").items() if "python" in of}


def options():
    """Name and declaration of each; those of a method have its field's type and default."""
    found = declared("options")
    fields = dict(methods.methods())
    for name, of in found.items():
        if "of" in of:
            field = fields[of["of"]]["fields"][name]
            default = repr(field["default"]) if "type" in field else methods.number(field["default"])
            found[name] = {"type": field.get("type", "number"), "default": default} | of
        if "range" in of and of["type"] not in ("int", "number", "seconds", "float | str"):
            raise Failure(f"options.toml: {name} is not a number, but has a range")
    return found


# --- C++ -------------------------------------------------------------------------------------------

def cpp_ranges():
    for name, of in options().items():
        if "range" in of:
            limits, words, _, _ = interval(of, whole=of["type"] in ("int", "seconds"))
            unit = f" {of['words']}" if "words" in of else ""
            yield f"inline constexpr OptionRange {name} = {{{{{limits}}}, {quoted(words + unit)}}};\n"


def cpp_fields():
    def kind(of):
        value = {"bool": "bool", "number": "std::optional<double>",
                 "seconds": "std::optional<std::chrono::nanoseconds>"}.get(of["type"], of["type"])
        return f"std::optional<{value}>" if value == "QualityMetric" else value

    return [f'OptionField<{kind(of)}>{{{quoted(of["field"])}, &SmoothOptions::{of["member"]}, '
            f'{quoted(snake(of["type"]).rpartition("_")[2])}}}'
            for of in options().values() if "member" in of]


def cpp_options():
    fields = ",\n    ".join(cpp_fields())
    return cpp_header("meshsmooth", HEADER_INCLUDES, HEADER_TYPES, "namespace option {\n\n", *cpp_ranges(),
                      "\n}  // namespace option\n\n",
                      f"/// Those members.\ninline constexpr auto kOptionFields = std::make_tuple(\n    {fields});\n\n")


def shown(of):
    """What the help of a flag has behind its text."""
    if of["type"] == "bool" or of.get("captured"):
        return ""
    unit = f", in {of['words']}" if "words" in of else ""
    short = interval(of)[2] if "range" in of else ""
    limits = f", {short}" if short[:1] in "([" and short else ""
    text = of.get("shown", of.get("default", "none"))
    return unit + limits + (f" [{text}]" if text else "")


def iterations(motion):
    """The limits of the methods: those that are not the usual one by name."""
    found = [(name, of["default_iterations"]) for name, of in methods.methods() if (name == "move") == motion]
    most = max(limit for _, limit in found)
    own = [f"{name.replace('_', '-')} {limit}" for name, limit in found if limit != most]
    return ", ".join([*own, f"others {most}"] if own else [str(most)])


def cli_flags():
    def flag(name, text):
        return f"inline constexpr Flag {name}{{{quoted('--' + name.removeprefix('move_').replace('_', '-'))}, {quoted(text)}}};\n"

    rows = []
    for name, of in options().items():
        if "help" not in of:
            continue
        by_method = of.get("shown") == "methods"
        rows.append(flag(name, of["help"] + shown(of | {"shown": iterations(False)} if by_method else of)))
        if "move_help" in of:
            rows.append(flag("move_" + name, of["move_help"] + shown(of | {"shown": iterations(True)} if by_method else of)))
    return cpp_header("meshsmooth::cli", "", FLAG_TYPE, "namespace flag {\n\n", *rows, "\n}  // namespace flag\n\n")


# --- Python ----------------------------------------------------------------------------------------

def python_keyword(name, of):
    literals = literal_names()
    kind = PYTHON.get(of["type"], literals.get(of["type"], of["type"]))
    if "values" in of:
        kind = f"Literal[{', '.join(map(quoted, of['values']))}]"
    said = {"default": of.get("default", ""), "unit": of.get("unit", ""),
            "takes": of.get("takes", TAKES_SECONDS if of["type"] == "seconds" else ""), "field": of.get("field", "")}
    arguments = [quoted(of["python"])] + [f"{key}={quoted(value)}" for key, value in said.items() if value]
    arguments += ["topology=True"] * of.get("topology", False)
    return f"    {name}: Annotated[{kind}, Option({', '.join(arguments)})]\n"


def python_options():
    found = options()
    return python_module(
        "The keywords of jobs, each with its type, default, unit, meaning, and field on the wire.",
        PYTHON_IMPORTS,
        f'class JobOptions(TypedDict, total=False):\n    """{SMOOTH_DOC}"""\n\n',
        *(python_keyword(name, of) for name, of in found.items() if not of.get("move")),
        '\n\nclass MoveOptions(JobOptions, total=False):\n'
        '    """The keywords of `move`: those of `smooth`, and how the mesh moves."""\n\n',
        *(python_keyword(name, of) for name, of in found.items() if of.get("move")))


# --- documents -------------------------------------------------------------------------------------

def option_table():
    """The names of every option that the wire has."""
    def cell(text):
        return f"`{text}`" if text else ""

    def row(name, of):
        default = iterations(False) if of.get("shown") == "methods" else of.get("default", "").strip("'").lower()
        return [cell(of["field"].replace("spec.", "JobSpec.")), cell(f"--{name.replace('_', '-')}" if "help" in of else ""),
                cell(name), interval(of)[2] if "range" in of else "", default]

    return table(["Field of `SmoothingOptions`", "Command line", "Python", "Range", "Default"],
                 [row(name, of) for name, of in options().items() if "field" in of and "of" not in of])


FILES = {
    "core/include/meshsmooth/option_table.hpp": cpp_options,
    "client/cli/job_flags.hpp": cli_flags,
    "client/python/src/meshsmooth/_declared_options.py": python_options,
}
TABLES = {"options": option_table}
