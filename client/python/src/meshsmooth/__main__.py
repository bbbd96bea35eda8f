"""The command `meshsmooth` of the Python package: `python -m meshsmooth`.

It reads and writes what PyVista, gmsh and meshio do. The C++ program of the same name has more
formats and commands, which change nothing of a file but its coordinates.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

import meshsmooth as ms

from ._adapters import read_mesh
from ._files import read_file
from ._job_options import MOVE_OPTIONS, OPTIONS, Declared, choices_of
from ._option import Option

# Those of the C++ program.
_FAILED, _USAGE, _BAD_MESH, _REFUSED, _TOO_LATE, _NOT_MET = 1, 2, 3, 4, 5, 6
_MESH_FILES = ("reference", "to", "surface")  # their arguments are files of meshes
_PAIRS = ("periodic",)  # of names
_LISTS = ("fixed", "fixed_types", "prescribed", "element_quality")
_ELSEWHERE = ("progress", "request_id", "result_ttl", "traceparent")  # of no use to a program that waits


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command and returns its exit code."""
    parsed = _parser().parse_args(arguments)
    try:
        return int(parsed.run(parsed))
    except ms.Error as error:
        print(f"error: {error}", file=sys.stderr)
        return _code_of(error)
    except (OSError, ImportError, ValueError, TypeError) as error:
        print(f"error: {error}", file=sys.stderr)
        return _FAILED
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr)
        return _TOO_LATE


def _code_of(error: ms.Error) -> int:
    for kinds, code in (
        (ms.InvalidMesh, _BAD_MESH),
        (ms.InvalidOption, _USAGE),
        ((ms.DeadlineExceeded, ms.Cancelled), _TOO_LATE),
        ((ms.Unavailable, ms.Busy, ms.TooLarge, ms.AccessDenied), _REFUSED),
    ):
        if isinstance(error, kinds):
            return code
    return _FAILED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="meshsmooth",
        description="Improves finite-element meshes. The server is that of $MESHSMOOTH_SERVER, or "
        "one that is started.",
    )
    parser.add_argument("--version", action="version", version=ms.__version__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def add(name: str, run: Any, text: str, options: Declared) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(run=run, options=tuple(options))
        command.add_argument("mesh", metavar="IN", help="mesh file")
        for option in options:
            _add_option(command, option, *options[option])
        return command

    for name, run, text, table in (
        ("smooth", _smooth, "Smooth a mesh file", OPTIONS),
        ("move", _move, "Move nodes of a mesh file; the others follow", MOVE_OPTIONS),
    ):
        chosen = {option: table[option] for option in table if option not in _ELSEWHERE}
        command = add(name, run, text, chosen)
        command.add_argument("-o", "--output", required=True, metavar="OUT", help="mesh file")
        command.add_argument("--json", metavar="FILE", help="output file of the whole summary")
        command.add_argument("--quiet", action="store_true", help="no output but errors")
    waiting = ("backend", "priority", "queue_timeout", "timeout")
    add("quality", _quality, "Print the quality of a mesh file", {n: OPTIONS[n] for n in waiting})
    compare = add("compare", _compare, "Tell what differs between two mesh files", {})
    compare.add_argument("other", metavar="OTHER", help="mesh file")
    return parser


def _add_option(parser: argparse.ArgumentParser, name: str, kind: Any, option: Option) -> None:
    unit = f"; {option.unit}" if option.unit else ""
    default = f" [{option.default}]" if option.default else ""
    keywords: dict[str, Any] = {"help": f"{option.meaning}{unit}{default}".replace("%", "%%")}
    choices = choices_of(kind)
    if name in _PAIRS:
        keywords |= {"nargs": 2, "action": "append", "metavar": ("SIDE", "SIDE")}
    elif name in _LISTS:
        keywords |= {"nargs": "+", "choices": choices or None}
        keywords |= {} if choices else {"metavar": "NAME"}
    elif name in _MESH_FILES:
        keywords["metavar"] = "FILE"
    elif name == "method":
        keywords["choices"] = choices or ["move"]
    elif choices:
        keywords["choices"] = choices
    elif kind is bool:
        keywords |= {"type": _to_bool, "metavar": "on|off"}
    elif kind in (int, float):
        keywords |= {"type": kind, "metavar": kind.__name__.upper()}
    else:
        keywords |= {"metavar": "VALUE", "type": _to_number_or_text}
    parser.add_argument(f"--{name.replace('_', '-')}", dest=name, **keywords)


def _to_bool(text: str) -> bool:
    if text not in ("on", "off"):
        raise argparse.ArgumentTypeError(f"{text!r} is neither on nor off")
    return text == "on"


def _to_number_or_text(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _options(parsed: argparse.Namespace) -> dict[str, Any]:
    given = {name: getattr(parsed, name) for name in parsed.options}
    options = {name: value for name, value in given.items() if value is not None}
    for name in _MESH_FILES:
        if name in options:
            options[name] = read_file(options[name]).mesh
    if options.get("regions") == "none":
        options["regions"] = None
    return options


def _smooth(parsed: argparse.Namespace) -> int:
    return _run(parsed, ms.smooth)


def _move(parsed: argparse.Namespace) -> int:
    return _run(parsed, ms.move)


def _run(parsed: argparse.Namespace, function: Any) -> int:
    file = read_file(parsed.mesh)
    progress = not parsed.quiet and sys.stderr.isatty()
    result = function(file.mesh, full=True, progress=progress, **_options(parsed))
    file.save(result.mesh, parsed.output)
    if parsed.json:
        with open(parsed.json, "w", encoding="utf-8") as out:
            out.write(result.summary.to_json(indent=2) + "\n")
    if not parsed.quiet:
        print(result.summary)
    motion = result.summary.motion
    return _NOT_MET if motion is not None and motion.reached < 1 else 0


def _quality(parsed: argparse.Namespace) -> int:
    print(ms.quality(read_file(parsed.mesh).mesh, **_options(parsed)))
    return 0


def _compare(parsed: argparse.Namespace) -> int:
    one, other = (read_mesh(read_file(path).mesh) for path in (parsed.mesh, parsed.other))
    differences = []
    if one.node_count != other.node_count:
        differences.append(f"{one.node_count:,} nodes and {other.node_count:,}")
    else:
        way = np.linalg.norm(other.points.astype(float) - one.points, axis=1)
        moved = np.flatnonzero(way > 0)
        print(f"{len(moved):,} of {one.node_count:,} nodes moved", end="")
        farthest = int(way.argmax())
        print(f", node {farthest} farthest, by {way[farthest]:.6g}" if len(moved) else "")
    if not one.has_elements_of(other):
        differences.append("the elements differ")
    for what, mine, theirs in (
        ("node", one.data.point_data, other.data.point_data),
        ("cell", one.data.cell_data, other.data.cell_data),
    ):
        for name in sorted({*mine, *theirs}):
            if name not in mine or name not in theirs:
                differences.append(f"only one has the {what} array {name!r}")
            elif not _same(mine[name], theirs[name]):
                differences.append(f"the {what} array {name!r} differs")
    for difference in differences:
        print(difference)
    if not differences:
        print("nothing else differs")
    return _NOT_MET if differences else 0


def _same(one: Any, other: Any) -> bool:
    a, b = np.asarray(one), np.asarray(other)
    numbers = a.dtype.kind == b.dtype.kind == "f"
    return np.array_equal(a, b, equal_nan=numbers)


if __name__ == "__main__":
    sys.exit(main())
