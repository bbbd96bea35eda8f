"""Error reasons, and calls that fail without one."""

import re

from common import Failure, cpp_array, cpp_table, declared, python_module, python_tuple, quoted, table

def reasons(origins=("server", "client")):
    """Yields name, origin, status and row of each."""
    found = declared("reasons")
    for origin in origins:
        for status, rows in found[origin].items():
            for name, row in rows.items():
                yield name, origin, status, row


def cpp_reasons():
    def row(name, origin, status, of):
        texts = [", ".join(of.get("details", ())), of["meaning"], of.get("retry", "no")]
        delay = f", milliseconds({of['delay_ms']})" if "delay_ms" in of else ""
        return f"{{{quoted(name)}, {origin}, {status}, {of['exit']}, {', '.join(map(quoted, texts))}{delay}}}"

    statuses = declared("reasons")["status"]
    return cpp_table(
        cpp_array("ErrorReason", "kReasons", [row(*reason) for reason in reasons()]),
        "\n/// By the number of a code; 0 is gRPC's OK.\n",
        cpp_array("Status", "kStatuses", ['{"OK", done}'] + [
            f"{{{quoted(name.upper())}, {of['exit']}}}" for name, of in statuses.items()]))


def python_reasons():
    def kind(of):
        return of.get("python") or ("InvalidMesh" if of.get("exit") == "bad_mesh" else None)

    def entries(rows):
        return "".join(f"    {quoted(name)}: errors.{kind(of)},\n" for name, of in rows if kind(of))

    statuses = [(name.upper(), of) for name, of in declared("reasons")["status"].items()]
    return ("ERRORS_BY_REASON: dict[str, type[errors.Error]] = {\n" +
            entries((name, of) for name, _, _, of in reasons()) +
            "}\nERRORS_BY_STATUS: dict[str, type[errors.Error]] = {\n" + entries(statuses) + "}\n")


def server_reasons():
    return table(["Reason", "Code", "With", "Try again?", "Meaning"], [
        [f"`{name}`", status.upper(), ", ".join(f"`{key}`" for key in of.get("details", ())),
         of.get("retry", "no"), of["meaning"]]
        for name, _, status, of in reasons(["server"])])


def client_reasons():
    return table(["Reason", "Meaning"],
                 [[f"`{name}`", of["meaning"]] for name, _, _, of in reasons(["client"])])


def hint(text, language):
    """A hint in the words of a library; {server} is left to it."""
    names = declared("failures")["names"]
    words = names["both"] | names[language]
    filled = re.sub(r"\{(\w+)\}", lambda found: words.get(found[1], found[0]), text)
    if left := set(re.findall(r"\{\w*\}", filled)) - {"{server}"}:
        raise Failure(f"failures.toml: {', '.join(left)} has no {language} name")
    return filled


def cpp_failures():
    def row(of):
        statuses = ", ".join(f"StatusCode::{name}" for name in of["status"])
        texts = ", ".join(map(quoted, of.get("texts", ())))
        return (f"{{{{{statuses}}}, Condition::{of.get('condition', 'none')}, {of.get('reset', -1)}, "
                f"{{{texts}}}, {quoted(hint(of['hint'], 'cpp'))}}}")

    found = declared("failures")
    return cpp_table(
        cpp_array("std::string_view", "kNeverConnected", map(quoted, found["never_connected"])),
        cpp_array("Failure", "kFailures", map(row, found["failure"])),
        *(f"constexpr std::string_view k{name.title().replace('_', '')}Hint = {quoted(hint(text, 'cpp'))};\n"
          for name, text in found["hints"].items()))


def python_failures():
    def row(of):
        texts = "(" + "".join(f"{quoted(text)}, " for text in of.get("texts", ())).rstrip(" ") + ")"
        statuses = "(" + ", ".join(quoted(name.upper()) for name in of["status"]) + ",)"
        return (f"Failure({statuses}, {quoted(of.get('condition', ''))}, {of.get('reset', -1)}, {texts}, "
                f"{quoted(hint(of['hint'], 'python'))})")

    found = declared("failures")
    return ("NEVER_CONNECTED = " + python_tuple(map(quoted, found["never_connected"])) +
            "FAILURES = " + python_tuple(map(row, found["failure"])) +
            "".join(f"{name.upper()}_HINT = {quoted(hint(text, 'python'))}\n"
                    for name, text in found["hints"].items()))


def foreign_failures():
    return table(["What the client sees", "Usual cause"],
                 [[of["seen"], of["cause"]] for of in declared("failures")["failure"] if "seen" in of])


FAILURE = '''from typing import NamedTuple

from . import _errors as errors


class Failure(NamedTuple):
    """Calls that fail without a reason, by what is seen of them."""

    statuses: tuple[str, ...]
    condition: str  # "", "never_connected", "unanswered" or "cancelled"
    reset: int  # error code of an RST_STREAM; -1: any text
    texts: tuple[str, ...]
    hint: str


'''


def python_tables():
    return python_module("Error reasons and failures of calls.", FAILURE, python_reasons(), python_failures())


FILES = {
    "core/src/mesh/error_reasons.inc": cpp_reasons,
    "client/library/src/failures.inc": cpp_failures,
    "client/python/src/meshsmooth/_tables.py": python_tables,
}
TABLES = {
    "server-reasons": server_reasons,
    "client-reasons": client_reasons,
    "foreign-failures": foreign_failures,
}
