#include "command_tree.hpp"

#include <CLI/Option.hpp>
#include <algorithm>
#include <cctype>
#include <functional>
#include <regex>
#include <sstream>

#include "mesh_file.hpp"

namespace meshsmooth::cli {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) {
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

/// The first run of extensions in a help, ".vtu .vtk".
std::vector<std::string> extensions_in(const std::string& help) {
  static const std::regex pattern(R"((?:^|[ (])(\.[a-z0-9]+(?: \.[a-z0-9]+)*)(?=$|[^a-z0-9.]))");
  std::smatch match;
  return std::regex_search(help, match, pattern) ? split(match[1], ' ')
                                                 : std::vector<std::string>();
}

/// A path, by what its help begins with; after the method that it belongs to, "optimize: ".
ValueKind kind_of_path(const std::string& help, std::vector<std::string>& extensions) {
  static const std::regex mesh(R"(^(?:[a-z, -]+: )?(?:[A-Za-z]+ )?[Mm]esh file)");
  static const std::regex file(R"(^(?:[a-z, -]+: )?(?:[A-Za-z]+ )?[Ff]ile\b)");
  const bool names_mesh = std::regex_search(help, mesh);
  const bool names_file = std::regex_search(help, file);
  const std::vector<std::string> found = extensions_in(help);
  if (!found.empty() && (names_mesh || names_file || help.starts_with("Where it goes"))) {
    extensions = found;
    return ValueKind::mesh;
  }
  if (names_mesh) {
    extensions = split(formats::readable_extensions(), ' ');
    return ValueKind::mesh;
  }
  return names_file ? ValueKind::file : ValueKind::text;
}

void describe_value(Argument& argument, const CLI::Option& option) {
  if (option.get_items_expected_max() == 0) return;
  static const std::regex choices(R"(\{([^{}]*)\})");
  static const std::regex range(R"( in \[(.*)\])");
  const std::string type = option.get_type_name();
  std::smatch match;
  if (std::regex_search(type, match, choices)) {
    argument.kind = ValueKind::choice;
    argument.choices = split(match[1], ',');
    std::erase_if(argument.choices, [](const std::string& choice) {  // "cuda:N" is a pattern
      return std::ranges::any_of(choice, [](unsigned char c) { return std::isupper(c) != 0; });
    });
  } else if (type.starts_with("INT") || type.starts_with("UINT") || type.starts_with("FLOAT")) {
    argument.kind = ValueKind::number;
    if (std::regex_search(type, match, range)) argument.range = match[1];
  } else if (argument.names.back().ends_with("-set")) {
    argument.kind = ValueKind::node_set;
  } else {
    argument.kind = kind_of_path(argument.help, argument.extensions);
  }
  argument.default_text = option.get_default_str();
  argument.list = option.get_delimiter() != '\0';
}

Argument describe(const CLI::Option& option) {
  Argument argument;
  if (option.get_positional()) {
    argument.names = {option.get_name(true)};
  } else {
    for (const std::string& name : option.get_snames()) argument.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) argument.names.push_back("--" + name);
  }
  argument.help = option.get_description();
  argument.group = option.get_group();
  argument.required = option.get_required();
  describe_value(argument, option);
  return argument;
}

Command describe(const CLI::App& app, const std::string& name, const std::string& above) {
  Command command{.path = above.empty() ? name : above + " " + name,
                  .name = name,
                  .description = app.get_description(),
                  .positionals = {},
                  .options = {},
                  .commands = {}};
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    auto& arguments = option->get_positional() ? command.positionals : command.options;
    arguments.push_back(describe(*option));
  }
  const std::function<bool(const CLI::App*)> all;
  for (const CLI::App* below : app.get_subcommands(all)) {
    if (below->get_group().empty()) continue;
    command.commands.push_back(describe(*below, below->get_name(), command.path));
  }
  return command;
}

}  // namespace

Command describe_program(const CLI::App& app, const std::string& name) {
  return describe(app, name, "");
}

std::string placeholder(const Argument& argument) {
  const auto repeated = [&](const std::string& word) {
    return argument.list ? word + "," + word + "..." : word;
  };
  switch (argument.kind) {
    case ValueKind::none:
      return "";
    case ValueKind::text:
      return repeated("TEXT");
    case ValueKind::number:
      return repeated("NUMBER");
    case ValueKind::choice:
      return repeated("CHOICE");
    case ValueKind::file:
      return "FILE";
    case ValueKind::mesh:
      return "MESH";
    case ValueKind::node_set:
      return "SET";
  }
  return "";
}

std::string brief_help(const std::string& help) {
  std::size_t end = help.size();
  for (const char* stop : {". ", "; ", " [", " (", "\n"}) end = std::min(end, help.find(stop));
  return help.substr(0, end);
}

}  // namespace meshsmooth::cli
