#include "completion.hpp"

namespace meshsmooth::cli {
namespace {

constexpr const char* kHead = R"(#compdef @program@
# Completion of @program@ for zsh; made by `meshsmooth completion zsh`.

# Completes by the node sets of the mesh file, which is the first argument.
@prefix@_sets() {
  local file=${(Q)line[1]}
  local -a names
  [[ -n $file ]] || return 1
  names=("${(@f)$(timeout 10 @program@ list-sets ${~file} 2>/dev/null)}")
  compadd -- ${names:#}
}
)";

constexpr const char* kTail = R"(
if [[ $funcstack[1] == @prefix@ ]]; then
  @prefix@ "$@"
else
  compdef @prefix@ @program@
fi
)";

std::string shell_quoted(const std::string& text) {
  return "'" + replaced(text, "'", "'\\''") + "'";
}

/// Of _arguments, where brackets and colons have a meaning.
std::string escaped(std::string text) {
  for (const char* special : {"\\", "[", "]", ":"}) {
    text = replaced(std::move(text), special, std::string("\\") + special);
  }
  return text;
}

/// ":MESH:_files -g '*.(vtu|vtk)'", what _arguments takes of a value; empty for a switch.
std::string value_spec(const Argument& argument, const std::string& message,
                       const std::string& prefix) {
  const std::string start = ":" + escaped(message) + ":";
  switch (argument.kind) {
    case ValueKind::none:
      return "";
    case ValueKind::text:
    case ValueKind::number:
      return start + " ";
    case ValueKind::choice: {
      std::vector<std::string> choices;
      for (const std::string& choice : argument.choices) choices.push_back(escaped(choice));
      return argument.list ? start + "_values -s , choice " + joined(choices, " ")
                           : start + "(" + joined(choices, " ") + ")";
    }
    case ValueKind::file:
      return start + "_files";
    case ValueKind::mesh:
      return start + "_files -g \"(#i)*.(" + extension_pattern(argument) + ")(|.gz)(-.)\"";
    case ValueKind::node_set:
      return start + prefix + "_sets";
  }
  return "";
}

std::string option_specs(const Argument& option, const std::string& prefix) {
  const bool repeated = option.list || option.kind == ValueKind::node_set;
  const std::string excludes = repeated ? "*" : "(" + joined(option.names, " ") + ")";
  std::string specs;
  for (const std::string& name : option.names) {
    const std::string equals = option.kind != ValueKind::none && name.starts_with("--") ? "=" : "";
    specs += " \\\n    " +
             shell_quoted(excludes + name + equals + "[" + escaped(brief_help(option.help)) + "]" +
                          value_spec(option, placeholder(option), prefix));
  }
  return specs;
}

std::string function_name(const Command& command) {
  return "_" + replaced(replaced(command.path, "-", "_"), " ", "__");
}

void add_function(const Command& command, const std::string& prefix, std::string& text) {
  for (const Command& below : command.commands) add_function(below, prefix, text);
  std::string specs;
  for (const Argument& option : command.options) specs += option_specs(option, prefix);
  text += "\n" + function_name(command) + "() {\n";
  if (command.commands.empty()) {
    for (std::size_t i = 0; i < command.positionals.size(); ++i) {
      const Argument& argument = command.positionals[i];
      specs += " \\\n    " + shell_quoted(std::to_string(i + 1) +
                                          value_spec(argument, argument.names.front(), prefix));
    }
    text += "  local -a line\n  local -A opt_args\n  _arguments" + specs + "\n}\n";
    return;
  }
  text += "  local state\n  local -a line commands\n  local -A opt_args\n  commands=(\n";
  std::string cases;
  for (const Command& below : command.commands) {
    text += "    " + shell_quoted(below.name + ":" + brief_help(below.description)) + "\n";
    cases += "      " + below.name + ") " + function_name(below) + " ;;\n";
  }
  text += "  )\n  _arguments -C" + specs +
          " \\\n    '1: :->command' \\\n    '*:: :->arguments'\n  case $state in\n"
          "    command) _describe -t commands command commands ;;\n"
          "    arguments) case $line[1] in\n" +
          cases + "      esac ;;\n  esac\n}\n";
}

}  // namespace

std::string zsh_completion(const Command& program) {
  const std::string prefix = function_prefix(program);
  std::string text = kHead;
  add_function(program, prefix, text);
  text += kTail;
  return replaced(replaced(text, "@prefix@", prefix), "@program@", program.name);
}

}  // namespace meshsmooth::cli
