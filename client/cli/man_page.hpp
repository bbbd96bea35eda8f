#pragma once

#include <string>

#include "command_tree.hpp"

namespace meshsmooth::cli {

/// What a manual page says beyond the options; text in roff, or empty for no such section.
struct ManPageFacts {
  std::string section = "1";
  std::string version;
  std::string date;         // "2026-11-23"
  std::string exit_status;  // items
  std::string examples;     // lines of a shell
  std::string environment;  // items
  std::string files;        // items
  std::string see_also;     // "meshsmooth(1), meshsmooth-server(8)"
};

/// The page of one command in man(7); of a program with commands, with the list of them; of a
/// command whose commands have options of their own, as `generate`, with those too.
[[nodiscard]] std::string man_page(const Command& command, const ManPageFacts& facts);

/// "meshsmooth-smooth": the name of a command's page.
[[nodiscard]] std::string man_page_name(const Command& command);

/// One item of a list in roff: a bold or italic term and its text.
[[nodiscard]] std::string man_item(const std::string& term, const std::string& text);

}  // namespace meshsmooth::cli
