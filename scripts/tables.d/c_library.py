"""The C library: its enumerations, the structure of options with its defaults, and what C++ takes of it.

A structure that programs were compiled with only grows at its end: client/c/order.txt has the order of methods and
options in C, and what the declaration has beyond it goes to its end.
"""

import re

import enums
import methods
import options
from common import NOTE, ROOT, Failure, camel, cpp_comment, cpp_member, declared, interval, snake

ORDER = "client/c/order.txt"
ORDER_HEAD = """\
# The order of methods and options in C, which programs are compiled with. Nothing of it may move or go; scripts/tables
# adds what is new in proto/declaration to the end.
"""
REPORTED = ("JobState", "StopReason", "EndRule")  # enumerations of results
TYPES = {"number": "double", "seconds": "double", "text": "const char*"}
UNSET = {"seconds": "0: unset", "text": "null: unset"}


class Member:
    """A member of the structure: its kind, its default as C writes it, its comment, and where C++ has it."""

    def __init__(self, kind, default, doc, place=None):
        self.kind, self.default, self.doc, self.place = kind, default, doc, place
        self.type = TYPES.get(kind, "int64_t")


def first(enum):
    return 0 if declared("enums")[enum].get("from_zero") else 1


def constant(enum, value):
    return f"MESHSMOOTH_{snake(enum).upper()}_{value.upper()}"


def choices(kind):
    return f", {constant(kind, '…')}" if kind in declared("enums") else ""


def sentence(text):
    text = text.strip().rstrip(".")
    return text[0].upper() + text[1:]


def field_members():
    """The fields of all methods by their names; those of one name are one member."""
    found, users = {}, {}
    for method, of in methods.methods():
        for name, field in of["fields"].items():
            if field.get("by_call"):
                continue
            kind = field.get("type", "number")
            default = constant(kind, field["default"]) if "type" in field else methods.number(field["default"])
            users.setdefault(name, []).append(method)
            member = Member(kind, default, methods.help_of(field) + choices(kind))
            if name in found and (found[name].kind, found[name].default) != (kind, default):
                raise Failure(f"methods.toml: {name} of {method} has another type or default than that of {users[name][0]}")
            found.setdefault(name, member)
    for name, member in found.items():
        member.doc = f"{sentence(member.doc)}; of {', '.join(users[name])}."
    return found


def default_of(name, of, kind):
    """As C writes it; what is unset is 0, or -1 where 0 has a meaning."""
    text = of.get("default", "")
    if kind == "bool":
        return str(int(text == "True"))
    if kind == "int":
        return "-1" if of.get("shown") == "methods" else text
    if kind == "number":
        return text or ("-1" if of["range"].startswith("[0") else "0")
    if kind in TYPES:
        return "0" if kind == "seconds" else "NULL"
    if not text:
        return "0"
    shown = text.strip("'").replace("-", "_")
    values = dict(zip(enums.names(declared("enums")[kind]), declared("enums")[kind]["values"]))
    if shown not in values:
        raise Failure(f"options.toml: {kind} has no value {text}, the default of {name}")
    return constant(kind, values[shown])


def option_members():
    """The options that C++ has, by their names in C."""
    for name, of in options.options().items():
        if "of" in of or not ("member" in of or "c" in of):
            continue
        place = of.get("c", f"smooth.{of.get('member')}")
        place = None if place == "by hand" else place
        share = of["type"] == "float | str"
        kind = "number" if share else of["type"]
        default = default_of(name, of, kind)
        limits = interval(of)[2] if "range" in of else ""
        limits = f", {limits}" if limits not in of["python"] else ""
        unset = UNSET.get(kind) or ("" if of.get("default") and default != "-1" else f"{default}: unset")
        doc = f"{sentence(of['python']).replace('False', '0')}{choices(kind)}{limits}{', in ' + of['words'] if kind == 'number' and 'words' in of else ''}"
        doc += f"; {unset}." if unset else "."
        yield name + "_seconds" * (kind == "seconds"), Member(kind, default, doc, place)
        if share:
            yield name + "_relative", Member("bool", "0", f"Whether {name} is a share of the bounding box's diagonal.")


def ordered(kind, found):
    """The names that were declared, in the order of programs that exist."""
    text = (ROOT / ORDER).read_text(encoding="utf-8") if (ROOT / ORDER).exists() else ""
    known = re.findall(rf"^{kind} (\w+)$", text, re.MULTILINE)
    if gone := [name for name in known if name not in found]:
        raise Failure(f"{ORDER}: programs use the {kind} {gone[0]}, which the declaration lacks")
    return known + [name for name in found if name not in known]


def method_names():
    found = [name for name, _ in methods.methods()]
    return ordered("method", sorted(found, key=lambda name: name != methods.DEFAULT))


def members():
    default = f"MESHSMOOTH_METHOD_{methods.DEFAULT.upper()}"
    found = {"method": Member("method", default, "How nodes move, MESHSMOOTH_METHOD_…")}
    found |= field_members() | dict(option_members())
    return {name: found[name] for name in ordered("option", found)}


def order():
    return (ORDER_HEAD + "".join(f"method {name}\n" for name in method_names()) +
            "".join(f"option {name}\n" for name in members()))


# --- C ---------------------------------------------------------------------------------------------

def c_enum(doc, name, values):
    rows = "".join(cpp_member(f"{value} = {number},", text) if text else f"  {value} = {number},\n"
                   for value, number, text in values)
    return f"{cpp_comment(doc)}enum meshsmooth_{name} {{\n{rows}}};\n\n"


def c_enums():
    statuses = declared("reasons")["status"]
    yield c_enum("What functions return: OK, or the status of a failed call with gRPC's numbers.", "status",
                 [("MESHSMOOTH_OK", 0, "")] + [(f"MESHSMOOTH_{name.upper()}", number, "")
                                               for number, name in enumerate(statuses, 1)])
    found = dict(methods.methods())
    yield c_enum("The methods.", "method", [(f"MESHSMOOTH_METHOD_{name.upper()}", number, found[name]["summary"])
                                            for number, name in enumerate(method_names(), 1)])
    used = {member.kind for member in members().values()} | set(REPORTED) | {"BackendKind"}
    for name, of in declared("enums").items():
        if name in used:
            yield c_enum(of["doc"], snake(name), [(constant(name, value), number, doc) for number, (value, doc) in
                                                  enumerate(of["values"].items(), first(name))])


def c_header():
    found = members()
    return (f"#ifndef MESHSMOOTH_OPTIONS_H\n#define MESHSMOOTH_OPTIONS_H\n\n// {NOTE}\n// clang-format off\n\n"
            "#include <stddef.h>\n#include <stdint.h>\n\n" + "".join(c_enums()) +
            cpp_comment("The options of a job, filled by meshsmooth_options_init. An enumeration that is 0 has its "
                        "default. Every member has 8 bytes; later versions have more of them behind these.") +
            "typedef struct meshsmooth_options {\n" + cpp_member("size_t size;", "sizeof(meshsmooth_options)") +
            "".join(cpp_member(f"{member.type} {name};", member.doc) for name, member in found.items()) +
            "} meshsmooth_options;\n\n#endif  // MESHSMOOTH_OPTIONS_H\n")


# --- C++ -------------------------------------------------------------------------------------------

def read(name, kind, place):
    if kind in declared("enums"):
        return f'read_choice(in.{name}, "{name}", {first(kind)}, {place});'
    return f'read(in.{name}, "{name}", {place});'


def cpp_options():
    def method(name, of):
        fields = "".join(f"      {read(key, field.get('type', 'number'), 'method.' + key)}\n"
                         for key, field in of["fields"].items() if not field.get("by_call"))
        return (f"    case MESHSMOOTH_METHOD_{name.upper()}: {{\n      {camel(name)} method;\n{fields}"
                "      return method;\n    }\n")

    found = members()
    defaults = "".join(f"    .{name} = {member.default},\n" for name, member in found.items())
    reads = "".join(f"  {read(name, member.kind, 'job.' + member.place)}\n"
                    for name, member in found.items() if member.place)
    return (f"// {NOTE}\n// clang-format off\n"
            "constexpr meshsmooth_options kDefaults = {\n    .size = sizeof(meshsmooth_options),\n" + defaults + "};\n\n"
            "Method read_method(const meshsmooth_options& in) {\n  switch (in.method) {\n" +
            "".join(method(*found_method) for found_method in methods.methods()) +
            "  }\n"
            f'  throw out_of_range("method", static_cast<double>(in.method), "from 1 to {len(method_names())}");\n}}\n\n'
            "void read_declared(const meshsmooth_options& in, Job& job) {\n"
            f"  job.smooth.method = read_method(in);\n{reads}}}\n")


FILES = {
    ORDER: order,
    "client/c/include/meshsmooth_options.h": c_header,
    "client/c/src/options.inc": cpp_options,
}
