#include <algorithm>

#include "completion.hpp"

namespace meshsmooth::cli {
namespace {

constexpr const char* kHead =
    R"(# Completion of @program@ for fish; made by `meshsmooth completion fish`.

# Folders, and files with one of some extensions (vtu|vtk).
function _@prefix@_files
    __fish_complete_path (commandline -ct) | string match -rie "(\.($argv[1])(\.gz)?|/)(\t.*)?\$"
end

# The node sets of the mesh file on the command line: of the first one that is no option's value.
function _@prefix@_sets
    set -l previous
    for word in (commandline -op)
        if not contains -- "$previous" @file_options@; and string match -rqi '\.(@extensions@)(\.gz)?$' -- $word
            timeout 10 @program@ list-sets (string replace -r '^~' $HOME -- $word) 2>/dev/null
            return
        end
        set previous $word
    end
end

complete -c @program@ -f
)";

std::string shell_quoted(const std::string& text) {
  return "'" + replaced(replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
}

/// The part of a `complete` about a value.
std::string value_part(const Argument& argument, const std::string& prefix) {
  switch (argument.kind) {
    case ValueKind::none:
      return "";
    case ValueKind::text:
    case ValueKind::number:
      return " -x";
    case ValueKind::choice:
      return argument.list ? " -x -a " + shell_quoted("(__fish_append , " +
                                                      joined(argument.choices, " ") + ")")
                           : " -x -a " + shell_quoted(joined(argument.choices, " "));
    case ValueKind::file:
      return " -r -F";
    case ValueKind::mesh:
      return " -x -a " +
             shell_quoted("(_" + prefix + "_files '" + extension_pattern(argument) + "')");
    case ValueKind::node_set:
      return " -x -a " + shell_quoted("(_" + prefix + "_sets)");
  }
  return "";
}

std::string names_below(const Command& command) {
  std::vector<std::string> names;
  for (const Command& below : command.commands) names.push_back(below.name);
  return joined(names, " ");
}

/// `condition`: that this command was given; empty for the program itself.
void add_command(const Command& command, const std::string& program, const std::string& prefix,
                 const std::string& condition, std::string& text) {
  std::string here = condition;
  if (!command.commands.empty()) {
    here += (here.empty() ? "not __fish_seen_subcommand_from "
                          : "; and not __fish_seen_subcommand_from ") +
            names_below(command);
  }
  const std::string start =
      "complete -c " + program + (here.empty() ? "" : " -n " + shell_quoted(here));
  for (const Command& below : command.commands) {
    text +=
        start + " -a " + below.name + " -d " + shell_quoted(brief_help(below.description)) + "\n";
  }
  for (const Argument& option : command.options) {
    text += start;
    for (const std::string& name : option.names) {
      text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    }
    text += value_part(option, prefix) + " -d " + shell_quoted(brief_help(option.help)) + "\n";
  }
  for (const Argument& argument : command.positionals) {
    text += start + replaced(value_part(argument, prefix), " -x -a", " -a") + "\n";
  }
  for (const Command& below : command.commands) {
    add_command(below, program, prefix,
                (condition.empty() ? "" : condition + "; and ") + "__fish_seen_subcommand_from " +
                    below.name,
                text);
  }
}

/// The options whose values are files, and the extensions of the meshes among them.
void find_files(const Command& command, std::vector<std::string>& options,
                std::string& extensions) {
  for (const Argument& option : command.options) {
    if (option.kind != ValueKind::mesh && option.kind != ValueKind::file) continue;
    options.insert(options.end(), option.names.begin(), option.names.end());
  }
  for (const Argument& argument : command.positionals) {
    if (argument.kind == ValueKind::mesh && extensions.empty()) {
      extensions = extension_pattern(argument);
    }
  }
  for (const Command& below : command.commands) find_files(below, options, extensions);
}

}  // namespace

std::string fish_completion(const Command& program) {
  const std::string prefix = function_prefix(program);
  std::vector<std::string> file_options;
  std::string extensions;
  find_files(program, file_options, extensions);
  std::ranges::sort(file_options);
  file_options.erase(std::unique(file_options.begin(), file_options.end()), file_options.end());

  std::string text = kHead;
  add_command(program, program.name, prefix, "", text);
  text = replaced(text, "@file_options@", joined(file_options, " "));
  text = replaced(text, "@extensions@", extensions);
  return replaced(replaced(text, "@prefix@", prefix), "@program@", program.name);
}

}  // namespace meshsmooth::cli
