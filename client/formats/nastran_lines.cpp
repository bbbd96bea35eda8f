#include "nastran_lines.hpp"

#include <algorithm>
#include <array>

namespace meshsmooth::formats {
namespace {

constexpr std::size_t kMarkColumn = 72;

bool is_volume_card(std::string_view line) {
  constexpr auto kNames = std::to_array<std::string_view>({"CTETRA", "CPYRA", "CPENTA", "CHEXA"});
  const bool columns = line.substr(0, kMarkColumn).find_first_of(",*\t") == std::string_view::npos;
  return columns &&
         std::ranges::any_of(kNames, [&](std::string_view name) { return line.starts_with(name); });
}

/// Whether a card goes on in this line, without a mark at its beginning.
bool is_unmarked_continuation(std::string_view line) {
  return line.starts_with("        ") && line.find_first_not_of(" \t\r") != std::string_view::npos;
}

}  // namespace

std::string mark_continuations(std::string_view text) {
  std::string result;
  bool in_card = false;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    in_card = is_volume_card(line) || (in_card && is_unmarked_continuation(line));
    if (in_card && is_unmarked_continuation(text.substr(0, text.find('\n')))) {
      const std::string_view card = line.substr(0, std::min(line.find('\r'), kMarkColumn));
      result.append(card).append(kMarkColumn - card.size(), ' ') += '+';
    } else {
      result += line;
    }
    result += '\n';
  }
  return result;
}

}  // namespace meshsmooth::formats
