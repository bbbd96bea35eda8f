"""Methods: C++ structs and traits, Python's dataclasses, ParaView's choices, the table of docs/methods.md."""

import keyword
import textwrap

import enums
from common import Failure, camel, cpp_comment, cpp_header, cpp_member, declared, interval, python_module, quoted, table

STRUCTS_END = '''\
/// A smoothing method with its parameters; `MethodTraits` describes each.
using Method =
    std::variant<{}>;

/// Whether a method moves nodes to prescribed positions.
[[nodiscard]] inline bool is_motion(const Method& method) {{
  return std::holds_alternative<Move>(method);
}}

/// What a method computes in place of a motion.
[[nodiscard]] inline Derivative derivative_of(const Method& method) {{
  const auto* move = std::get_if<Move>(&method);
  return move != nullptr ? move->derivative : Derivative::none;
}}

/// Whether the iterations of a method are the terms of a filter, which does not converge.
[[nodiscard]] inline bool is_filter(const Method& method) {{
  return std::holds_alternative<WindowedSinc>(method);
}}

/// Whether a method sweeps as `Optimize` does.
[[nodiscard]] inline bool sweeps_as_optimize(const Method& method) {{
  return {};
}}

'''
DEFAULT = "optimize"


def methods():
    """Yields name and declaration of each."""
    for name, of in declared("methods").items():
        if name != "order":
            yield name, of


def presets():
    """Yields method, name and values of each."""
    for method, of in methods():
        for name, values in of.get("presets", {}).items():
            yield method, name, values


def help_of(of):
    return of["help"] if "type" in of else f"{of['help']}, {interval(of)[2]}"


def number(value):
    return f"{value:g}"


# --- C++ -------------------------------------------------------------------------------------------

def cpp_structs():
    def member(name, of):
        kind = of.get("type", "double")
        value = f"{kind}::{of['default']}" if "type" in of else repr(of["default"])
        return cpp_member(f"{kind} {name} = {value};", of.get("doc", help_of(of) + "."))

    structs = [cpp_comment(of["doc"]) + f"struct {camel(name)} {{\n" +
               "".join(member(*field) for field in of["fields"].items()) + "};\n\n" for name, of in methods()]
    alike = ["is_motion(method)" if name == "move" else f"std::holds_alternative<{camel(name)}>(method)" for name, of in methods() if of.get("sweeps_as_optimize")]
    return cpp_header("meshsmooth", '#include <variant>\n\n#include "meshsmooth/enums.hpp"\n', *structs,
                      STRUCTS_END.format(", ".join(camel(name) for name, _ in methods()), " || ".join(alike)))


def cpp_traits():
    def field(method, name, of):
        member = f"&{method}::{name}"
        flag = "" if of.get("by_call") else "--" + name.replace("_", "-")  # callers choose a function instead
        texts = f"{quoted(flag)}, {quoted(help_of(of))}"
        wire = quoted(of.get("name", name))
        if "type" in of:
            return f"ChoiceField<{method}, {of['type']}>{{{wire}, {member}, kEnumNames<{of['type']}>, {texts}}}"
        limits, words, _, other = interval(of)
        agrees = f"[](const {method}& m) {{ return m.{name} < -m.{other[1:]}; }}" if other else "nullptr"
        return (f"NumberField<{method}>{{{wire}, {member}, {{{limits}}}, {quoted(words)}, {texts}, "
                f"{agrees}, {str(of.get('in_options', False)).lower()}}}")

    def traits(name, of):
        method = camel(name)
        fields = ",\n      ".join(field(method, *found) for found in of["fields"].items())
        forms = ", ".join(f"Form::{form}" for form in of["forms"])
        return (f"template <>\nstruct MethodTraits<{method}> {{\n"
                f"  static constexpr std::string_view name = {quoted(name)};\n"
                f"  static constexpr int default_iterations = {of['default_iterations']};\n"
                f"  static constexpr std::array forms = {{{forms}}};\n"
                f"  static constexpr std::string_view form_reason = {quoted(of.get('form_reason', ''))};\n"
                f"  static constexpr auto fields = std::make_tuple(\n      {fields});\n}};\n\n")

    def preset(found):
        method, name, values = found
        kinds = {key: field.get("type") for key, field in dict(methods())[method]["fields"].items()}
        fields = ", ".join(f".{key} = {kinds[key]}::{value}" if kinds[key] else f".{key} = {value}"
                           for key, value in values.items())
        return f"    MethodPreset{{{quoted(name)}, {camel(method)}{{{fields}}}}},\n"

    return cpp_header("meshsmooth", '#include <array>\n#include <string_view>\n#include <tuple>\n\n'
                      '#include "meshsmooth/method_field.hpp"\n', *(traits(*method) for method in methods()),
                      "/// A method with other defaults, by a name of its own.\nstruct MethodPreset {\n"
                      "  std::string_view name;  // as on the command line\n  Method method;\n};\n\n",
                      "inline const std::array kMethodPresets = {\n", *map(preset, presets()), "};\n\n")


# --- Python ----------------------------------------------------------------------------------------

def words():
    """The names that callers write: of the methods, the default first, then the presets."""
    names = sorted((name for name, _ in methods()), key=lambda name: name != DEFAULT)
    return [name.replace("_", "-") for name in names] + [name for _, name, _ in presets()]


def python_name(name):
    return name + "_" * keyword.iskeyword(name)


def python_class(name, of):
    own = {python_name(key): field for key, field in of["fields"].items() if not (field.get("in_options") or field.get("by_call"))}

    def describe(key, field):
        text = help_of(field)
        text = field.get("python", text[0].lower() + text[1:]).strip()
        default = field.get("shown", field["default"] if "type" in field else number(field["default"]))
        return textwrap.fill(f"{key}: {text} [{default}].", 100, initial_indent=" " * 8, subsequent_indent=" " * 12,
                             break_on_hyphens=False)

    return (f'@dataclass(frozen=True, kw_only=True)\nclass {camel(name)}:\n    """{of["summary"]}\n\n    Attributes:\n' +
            "\n".join(describe(*field) for field in own.items()) + '\n    """\n\n' +
            "".join(f"    {key}: {field.get('type', 'float')} | None = None\n" for key, field in own.items()) +
            f'\n    _name: ClassVar[str] = "{name}"\n    _iterations: ClassVar[int] = {of["default_iterations"]}\n\n\n')


def python_methods():
    found = sorted(methods(), key=lambda method: method[0] != DEFAULT)
    classes = [camel(name) for name, _ in found]
    def preset(method, name, values):
        fields = ", ".join(f'{python_name(key)}={quoted(value.replace("_", "-")) if isinstance(value, str) else value}'
                           for key, value in values.items())
        return f'NAMED_METHODS["{name}"] = {camel(method)}({fields})\n'

    wire = {python_name(key): field.get("name", key) for _, of in found for key, field in of["fields"].items()}
    return python_module(
        "Methods with their parameters, and what options have to choose from.\n\n"
        "What is unset stays unset: the server's default holds, in brackets here.",
        "from dataclasses import dataclass\nfrom typing import ClassVar, Literal\n\n",
        *(f"{name} = Literal[{', '.join(map(quoted, values))}]\n"
          for name, values in [*enums.literals(), ("MethodName", words())]), "\n\n",
        *(python_class(*method) for method in found),
        f"Method = {' | '.join(classes)}\n\n",
        "NAMED_METHODS: dict[str, Method] = {\n    method._name.replace(\"_\", \"-\"): method\n"
        f"    for method in ({', '.join(name + '()' for name in classes)})\n}}\n",
        *(preset(*found) for found in presets()),
        "# Fields that are called otherwise on the wire.\nWIRE_NAMES = {" +
        ", ".join(f'"{key}": "{name}"' for key, name in wire.items() if key != name) + "}\n")


def ordered():
    found = dict(methods())
    order = declared("methods")["order"]
    if left := {name for name, of in found.items() if "use" in of} ^ set(order):
        raise Failure(f"methods.toml: order lacks or invents {', '.join(sorted(left))}")
    return [(name, found[name]) for name in order]


def spoken(name, of):
    return [name.replace("_", "-"), *of.get("presets", {})]


def paraview():
    def choices(name, values):
        return f"{name} = (\n" + "".join(f'    "{value}",\n' for value in values) + ")\n"

    literals = dict(enums.literals())
    return (choices("METHODS", [word for method in ordered() for word in spoken(*method)]) +
            f"GOALS = ({', '.join(map(quoted, literals['Goal']))})\n"
            f"BOUNDARIES = ({', '.join(map(quoted, literals['Boundary']))})\n")


# --- documents -------------------------------------------------------------------------------------

def method_table():
    return table(["Method", "Name on the command line", "For", "Keeps a valid mesh valid"], [
        [f"[{title(name)}](#{name.replace('_', '-')})" + " (default)" * (name == DEFAULT),
         ", ".join(f"`{word}`" for word in spoken(name, of)), of["use"], of["keeps_valid"]]
        for name, of in ordered()])


def title(name):
    return declared("methods")[name].get("title", name.replace("_", " ").capitalize())


FILES = {
    "core/include/meshsmooth/methods.hpp": cpp_structs,
    "core/include/meshsmooth/method_table.hpp": cpp_traits,
    "client/python/src/meshsmooth/_methods.py": python_methods,
}
TABLES = {"methods": method_table, "choices": paraview}
