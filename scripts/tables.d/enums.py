"""Enumerations: C++ types with their names, their numbers on the wire, Python's literals."""

from common import cpp_comment, cpp_header, cpp_member, declared, quoted, snake

HELPERS = '''\
/// The names of the enumerators in their order, lower_snake_case.
template <class Enum>
inline constexpr std::array<std::string_view, 0> kEnumNames{};

/// @returns the name of an enumerator
template <class Enum>
[[nodiscard]] constexpr std::string_view enum_name(Enum value) {
  return kEnumNames<Enum>[static_cast<std::size_t>(value)];
}

/// @returns all enumerators in their order
template <class Enum>
[[nodiscard]] constexpr auto enum_values() {
  std::array<Enum, kEnumNames<Enum>.size()> values{};
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<Enum>(i);
  return values;
}

'''
WIRE = '''\
/// What an enumeration is on the wire: its type there, and the number of its first enumerator.
template <class Enum>
struct WireEnum;

'''


def names(of):
    texts = of.get("texts", {})
    return [texts.get(value, value) for value in of["values"]]


def literals():
    """Python's literals: name and values of each, as callers write them."""
    for of in declared("enums").values():
        if "python" in of:
            shown = [name for name, value in zip(names(of), of["values"]) if value not in of.get("hidden", ())]
            yield of["python"], shown if of.get("underscores") else [name.replace("_", "-") for name in shown]


def cpp_enums():
    def enum(name, of):
        texts = names(of)
        return (cpp_comment(of["doc"]) + f"enum class {name} {{\n" +
                "".join(cpp_member(f"{value},", doc) for value, doc in of["values"].items()) + "};\n\n" +
                f"template <>\ninline constexpr std::array<std::string_view, {len(texts)}> kEnumNames<{name}> = {{\n"
                f"    {', '.join(map(quoted, texts))}}};\n\n")

    return cpp_header("meshsmooth", "#include <array>\n#include <cstddef>\n#include <string_view>\n", HELPERS,
                      *(enum(name, of) for name, of in declared("enums").items()))


def cpp_wire():
    def enum(name, of):
        wire = of.get("wire", name)
        first = 0 if of.get("from_zero") else 1
        numbers = ["unspecified", *list(of["values"])[1 - first:]]
        checks = [f"v1::{snake(wire).upper()}_{value.upper()} == {number}" for number, value in enumerate(numbers)]
        checks.append(f"v1::{wire}_ARRAYSIZE == {len(numbers)}")
        together = " &&\n              ".join(checks)
        return (f"template <>\nstruct WireEnum<{name}> {{\n  using Type = v1::{wire};\n"
                f"  static constexpr int first = {first};\n}};\n"
                f"static_assert({together});\n\n")

    return cpp_header("meshsmooth::wire", '#include "meshsmooth/enums.hpp"\n#include "meshsmooth/v1/smoothing.pb.h"\n',
                      WIRE, *(enum(name, of) for name, of in declared("enums").items() if of.get("wire", name)))


FILES = {
    "core/include/meshsmooth/enums.hpp": cpp_enums,
    "proto/wire/wire_enum.hpp": cpp_wire,
}
