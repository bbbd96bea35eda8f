#include "man_page.hpp"

#include <algorithm>
#include <cctype>

#include "completion.hpp"

namespace meshsmooth::cli {
namespace {

/// For roff: backslashes, hyphens that are meant as such, and no control characters at the start
/// of a line.
std::string escaped(const std::string& text) {
  std::string result = replaced(replaced(replaced(text, "\\", "\\e"), "-", "\\-"), "`", "\\(ga");
  result = replaced(std::move(result), "\n.", "\n\\&.");
  result = replaced(std::move(result), "\n'", "\n\\&'");
  return result.starts_with('.') || result.starts_with('\'') ? "\\&" + result : result;
}

std::string bold(const std::string& text) { return "\\fB" + escaped(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + escaped(text) + "\\fR"; }

/// A sentence ends in a full stop.
std::string sentence(const std::string& text) {
  return text.empty() || text.ends_with('.') ? text : text + ".";
}

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

std::string heading(const std::string& title, const std::string& text) {
  return text.empty() ? "" : ".SH " + title + "\n" + text;
}

/// "-o, --output=MESH".
std::string term(const Argument& argument) {
  const std::string value = placeholder(argument);
  std::string text;
  for (const std::string& name : argument.names) {
    text += (text.empty() ? "" : ", ") + bold(name);
  }
  if (value.empty()) return text;
  return text + (argument.names.back().starts_with("--") ? "=" : " ") + italic(value);
}

std::string description(const Argument& argument) {
  std::string text = escaped(sentence(argument.help));
  if (argument.kind == ValueKind::choice) {
    text += " Choices: " + escaped(joined(argument.choices, ", ")) + ".";
  }
  if (!argument.range.empty())
    text += " Range: " + escaped(replaced(argument.range, " - ", " to ")) + ".";
  if (!argument.default_text.empty()) text += " Default: " + escaped(argument.default_text) + ".";
  if (argument.required) text += " Required.";
  return text;
}

/// The options, group by group; `level`: the macro of a group's title.
std::string options_text(const Command& command, const std::string& level) {
  std::vector<std::string> groups;
  for (const Argument& option : command.options) {
    if (std::ranges::find(groups, option.group) == groups.end()) groups.push_back(option.group);
  }
  std::string text;
  for (const Argument& argument : command.positionals) {
    text += ".TP\n" + italic(argument.names.front()) + "\n" + description(argument) + "\n";
  }
  for (const std::string& group : groups) {
    if (group != "Options") text += level + " " + escaped(group) + "\n";
    for (const Argument& option : command.options) {
      if (option.group != group) continue;
      text += ".TP\n" + term(option) + "\n" + description(option) + "\n";
    }
  }
  return text;
}

std::string synopsis(const Command& command) {
  std::string text = ".B " + escaped(command.path) + "\n";
  if (!command.commands.empty()) text += ".I COMMAND\n";
  for (const Argument& option : command.options) {
    if (!option.required) continue;
    text += bold(option.names.front()) + " " + italic(placeholder(option)) + "\n";
  }
  text += "[" + italic("OPTION") + "]...\n";
  for (const Argument& argument : command.positionals) {
    text += argument.required ? italic(argument.names.front()) + "\n"
                              : "[" + italic(argument.names.front()) + "]\n";
  }
  return text;
}

/// The first paragraph of the description of a program, whose exit codes have their own section.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

/// Of a program, the list of its commands and their pages; of a command, its commands in full.
std::string commands_text(const Command& command) {
  const bool is_program = command.path == command.name;
  std::string text;
  for (const Command& below : command.commands) {
    if (is_program) {
      text += ".TP\n" + bold(below.name) + "\n" + escaped(sentence(below.description)) + " See " +
              bold(man_page_name(below)) + "(1).\n";
    } else {
      text += ".SS " + escaped(below.name) + "\n" + escaped(sentence(below.description)) + "\n" +
              options_text(below, ".PP");
    }
  }
  return text;
}

}  // namespace

std::string man_page_name(const Command& command) { return replaced(command.path, " ", "-"); }

std::string man_item(const std::string& item, const std::string& text) {
  return ".TP\n" + bold(item) + "\n" + escaped(sentence(text)) + "\n";
}

std::string man_page(const Command& command, const ManPageFacts& facts) {
  const std::string name = man_page_name(command);
  const std::string about = first_line(command.description);
  std::string brief = brief_help(about);
  if (!brief.empty()) {
    brief[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(brief[0])));
  }
  if (brief.ends_with('.')) brief.pop_back();
  std::string text = ".TH " + upper(escaped(name)) + " " + facts.section + " \"" + facts.date +
                     "\" \"meshsmooth " + facts.version + "\" \"meshsmooth\"\n";
  text += ".nh\n.ad l\n";
  text += heading("NAME", escaped(name) + " \\- " + escaped(brief) + "\n");
  text += heading("SYNOPSIS", synopsis(command));
  text += heading("DESCRIPTION", escaped(sentence(about)) + "\n");
  text += heading("COMMANDS", commands_text(command));
  text += heading("OPTIONS", options_text(command, ".SS"));
  text += heading("EXIT STATUS", facts.exit_status);
  text += heading("ENVIRONMENT", facts.environment);
  text += heading("FILES", facts.files);
  if (!facts.examples.empty()) {
    text += heading("EXAMPLES", ".EX\n" + escaped(facts.examples) + ".EE\n");
  }
  text += heading("SEE ALSO", facts.see_also.empty() ? "" : escaped(facts.see_also) + "\n");
  return text;
}

}  // namespace meshsmooth::cli
