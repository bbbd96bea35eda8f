#include <algorithm>
#include <map>

#include "completion.hpp"

namespace meshsmooth::cli {
namespace {

constexpr const char* kHead =
    R"(# Completion of @program@ for bash; made by `meshsmooth completion bash`.

# Completes the current word, or its last part in a list, by words.
@prefix@_words() {
  local word before=''
  if [[ $1 == , ]]; then
    shift
    [[ $current != *,* ]] || before=${current%,*},
    compopt -o nospace 2>/dev/null
  fi
  for word in $1; do
    [[ $before$word != "$current"* ]] || COMPREPLY+=("$before$word")
  done
}

# Completes by folders and by files, those with one of some extensions (vtu|vtk) if there are any.
@prefix@_files() {
  local file pattern="\.($1)(\.gz)?\$"
  while IFS= read -r file; do COMPREPLY+=("$file"); done < <(compgen -d -- "$current")
  while IFS= read -r file; do
    [[ -n $1 && ! ${file,,} =~ $pattern ]] || COMPREPLY+=("$file")
  done < <(compgen -f -- "$current")
  compopt -o filenames 2>/dev/null
}

# Completes by the node sets of the mesh file.
@prefix@_sets() {
  local name quoted file=${mesh//[\\\'\"]/} program=${COMP_WORDS[0]/#\~/$HOME}
  [[ -n $file ]] || return
  while IFS= read -r name; do
    printf -v quoted %q "$name"
    [[ $name != "$current"* && $quoted != "$current"* ]] || COMPREPLY+=("$quoted")
  done < <(timeout 10 "$program" list-sets "${file/#\~/$HOME}" 2>/dev/null)
}
)";

constexpr const char* kBody = R"(
@prefix@() {
  local current=${COMP_WORDS[COMP_CWORD]} path=@program@ mesh='' word option='' position=0 i
  local option_here='' position_here=0 path_here=@program@ commands options valued
  COMPREPLY=()
  @prefix@_command "$path"
  for ((i = 1; i < ${#COMP_WORDS[@]}; i++)); do
    word=${COMP_WORDS[i]}
    if ((i == COMP_CWORD)); then
      option_here=$option position_here=$position path_here=$path
      [[ $word == = ]] || option=
    elif [[ -n $option ]]; then
      [[ $word == = ]] || option= # "--option=value" is three words
    elif [[ $word == -?* ]]; then
      [[ " $valued " != *" $word "* ]] || option=$word
    elif [[ " $commands " == *" $word "* ]]; then
      path+=" $word"
      @prefix@_command "$path"
    else
      ((position++ == 0)) && mesh=$word
    fi
  done
  @prefix@_command "$path_here"
  [[ $current != = ]] || current=
  if [[ -n $option_here ]]; then
    @prefix@_value "$path_here $option_here"
  elif [[ $current == -* ]]; then
    @prefix@_words "$options"
  elif [[ -n $commands ]]; then
    @prefix@_words "$commands"
  else
    @prefix@_value "$path_here $position_here"
    [[ -n $current || ${#COMPREPLY[@]} -gt 0 ]] || @prefix@_words "$options"
  fi
}
complete -F @prefix@ @program@
)";

/// What completes a value; empty where nothing does.
std::string completer(const Argument& argument, const std::string& prefix) {
  switch (argument.kind) {
    case ValueKind::choice:
      return prefix + "_words " + (argument.list ? ", '" : "'") + joined(argument.choices, " ") +
             "'";
    case ValueKind::file:
      return prefix + "_files ''";
    case ValueKind::mesh:
      return prefix + "_files '" + extension_pattern(argument) + "'";
    case ValueKind::node_set:
      return prefix + "_sets";
    case ValueKind::none:
    case ValueKind::text:
    case ValueKind::number:
      break;
  }
  return "";
}

void add_command(const Command& command, std::string& cases) {
  std::vector<std::string> names, options, valued;
  for (const Command& below : command.commands) names.push_back(below.name);
  for (const Argument& option : command.options) {
    options.insert(options.end(), option.names.begin(), option.names.end());
    if (option.kind != ValueKind::none) {
      valued.insert(valued.end(), option.names.begin(), option.names.end());
    }
  }
  cases += "    '" + command.path + "')\n      commands='" + joined(names, " ") +
           "'\n      options='" + joined(options, " ") + "'\n      valued='" + joined(valued, " ") +
           "'\n      ;;\n";
  for (const Command& below : command.commands) add_command(below, cases);
}

/// The values by what completes them, so that equal ones share a case.
using Values = std::map<std::string, std::vector<std::string>>;

void add_values(const Command& command, const std::string& prefix, Values& values) {
  const auto add = [&](const Argument& argument, const std::string& name) {
    const std::string how = completer(argument, prefix);
    if (!how.empty()) values[how].push_back("'" + command.path + " " + name + "'");
  };
  for (const Argument& option : command.options) {
    for (const std::string& name : option.names) add(option, name);
  }
  for (std::size_t i = 0; i < command.positionals.size(); ++i) {
    add(command.positionals[i], std::to_string(i));
  }
  for (const Command& below : command.commands) add_values(below, prefix, values);
}

}  // namespace

std::string bash_completion(const Command& program) {
  const std::string prefix = function_prefix(program);
  std::string cases;
  add_command(program, cases);
  Values values;
  add_values(program, prefix, values);
  std::string value_cases;
  for (const auto& [how, names] : values) {
    value_cases += "    " + joined(names, " | \\\n      ") + ")\n      " + how + "\n      ;;\n";
  }
  const std::string text = std::string(kHead) +
                           "\n# Sets what a command has: commands, options, options with a value.\n"
                           "@prefix@_command() {\n  case $1 in\n" +
                           cases +
                           "  esac\n}\n\n# Completes the value of \"COMMAND OPTION\" or "
                           "\"COMMAND POSITION\".\n@prefix@_value() {\n  case $1 in\n" +
                           value_cases + "  esac\n}\n" + kBody;
  return replaced(replaced(text, "@prefix@", prefix), "@program@", program.name);
}

}  // namespace meshsmooth::cli
