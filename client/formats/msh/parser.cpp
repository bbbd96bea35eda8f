#include <algorithm>
#include <cmath>
#include <utility>

#include "msh/foreign.hpp"
#include "msh/msh_content.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// The next section, which starts with $ at the beginning of a line; empty: there is none. Other
/// lines between sections mean nothing.
std::string_view next_section(Scanner& scanner) {
  while (!scanner.at_end()) {
    if (scanner.peek_line().starts_with('$')) return scanner.token_on_line();
    scanner.line();
  }
  return {};
}

/// Gmsh itself has written "$EndElememtData".
bool is_end(std::string_view word) { return word.starts_with("$End") || word.starts_with("$END"); }

bool ends_section(std::string_view section, std::string_view word) {
  const std::string_view name = section.substr(1);
  return is_end(word) && word.substr(4) == name;
}

/// Walks over a section and its end.
void skip_section(const path& file, Scanner& scanner, std::string_view text,
                  std::string_view section, bool binary) {
  for (std::size_t at = scanner.position(); (at = text.find('$', at)) != std::string_view::npos;
       ++at) {
    const std::size_t end = std::min(text.find_first_of(" \t\r\n", at), text.size());
    if (!ends_section(section, text.substr(at, end - at))) continue;
    const std::size_t line = text.find_last_not_of(" \t", at - 1);
    if (!binary && text[line] != '\n') continue;
    scanner.bytes(end - scanner.position());
    return;
  }
  fail("FILE_TRUNCATED", file,
       "there is no $End" + std::string(section.substr(1)) + " after " + std::string(section));
}

/// $MeshFormat: "version binary data-size", and in a binary file the number 1 in four bytes.
MshFormat read_format(const path& file, Scanner& scanner) {
  MshFormat format;
  const std::string_view version = scanner.token();
  const double number = scanner.parse<double>(version);
  format.version = 0;
  for (const int known : {10, 20, 21, 22, 30, 40, 41}) {
    if (std::abs(number * 10 - known) < 1e-6) format.version = known;
  }
  if (format.version == 0) {
    fail("FORMAT_ERROR", file,
         "MSH version " + std::string(version) +
             " is not supported; 1.0, 2.0 to 2.2, 3.0, 4.0 and 4.1 are");
  }
  const std::string_view binary = scanner.token();
  if (binary != "0" && binary != "1") scanner.refuse("0 (ASCII) or 1 (binary)", binary);
  format.binary = binary == "1";
  const std::string_view size = scanner.token_on_line();
  scanner.line();
  if (!format.binary) return format;
  if (format.version < 20) scanner.refuse("an ASCII file of MSH version 1", binary);
  if (format.version == 30) scanner.refuse("an ASCII file of MSH version 3", binary);
  if (size != "8" && (size != "4" || format.version < 41)) scanner.refuse("data of 8 bytes", size);
  format.size_bytes = size == "4" ? 4 : 8;
  const std::string_view one = scanner.bytes(4);
  format.swapped = one == std::string_view("\0\0\0\1", 4);
  if (!format.swapped && one != std::string_view("\1\0\0\0", 4)) {
    scanner.refuse("the number 1 in four bytes, which tells the order of bytes", one);
  }
  return format;
}

/// Development versions wrote what became 4.1 as "4": the first line of $Nodes has four numbers
/// there, two in 4.0.
bool has_layout_of_41(std::string_view text) {
  constexpr std::string_view kName = "\n$Nodes";
  const std::size_t at = text.find(kName);
  if (at == std::string_view::npos) return false;
  Scanner scanner({}, text.substr(at + kName.size()));
  scanner.line();
  std::size_t numbers = 0;
  while (!scanner.token_on_line().empty()) ++numbers;
  return numbers == 4;
}

[[noreturn]] void fail_foreign(const path& file, std::string_view text) {
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    fail("FILE_TRUNCATED", file, "there is nothing in it");
  }
  const std::string name = foreign_mesh_name(text);
  if (name.empty()) {
    fail("FORMAT_ERROR", file, "this is not Gmsh's MSH format: it has no $MeshFormat and no $NOD");
  }
  fail("FORMAT_ERROR", file, "this is " + name + ", not Gmsh's");
}

/// Which may come after other sections.
MshFormat find_format(const path& file, std::string_view text) {
  const auto has = [&](std::string_view name) { return text.find(name) != std::string_view::npos; };
  if (!has("$MeshFormat") && !has("$NOD") && !has("$ELM")) fail_foreign(file, text);
  Scanner scanner(file, text);
  while (true) {
    const std::string_view section = next_section(scanner);
    if (section == "$MeshFormat") {
      MshFormat format = read_format(file, scanner);
      if (format.version == 40 && !format.binary && has_layout_of_41(text)) format.version = 41;
      return format;
    }
    if (section == "$NOD" || section == "$ELM") return {};
    if (section.empty()) fail_foreign(file, text);
    skip_section(file, scanner, text, section, false);
  }
}

class MshParser {
 public:
  MshParser(const path& file, std::string_view text)
      : file_(file),
        text_(text),
        scanner_(file, text),
        numbers_(scanner_, text.size(), find_format(file, text)) {
    content_.format = numbers_.format();
    if (numbers_.binary()) {
      content_.nodes.style =
          numbers_.format().swapped ? NumberStyle::binary_swapped : NumberStyle::binary;
    }
  }

  MshContent parse() {
    while (true) {
      const std::string_view section = next_section(scanner_);
      if (section.empty()) break;
      ++sections_;
      if (!read(section)) {
        skip_section(file_, scanner_, text_, section, numbers_.binary());
        continue;
      }
      const std::string_view end = scanner_.token();
      if (!is_end(end)) {
        scanner_.refuse(
            "$End" + std::string(section.substr(1)) + " after all that the section announces", end);
      }
    }
    if (!has_nodes_) {
      fail(sections_ < 2 ? "FILE_TRUNCATED" : "MESH_EMPTY", file_, "there is no $Nodes section");
    }
    if (!has_elements_) fail("MESH_EMPTY", file_, "there is no $Elements section");
    return std::move(content_);
  }

 private:
  /// False: a section that is kept as it is.
  bool read(std::string_view section) {
    const bool has_entities = numbers_.format().has_entities();
    if (section == "$MeshFormat") {
      const MshFormat format = read_format(file_, scanner_);
      if (has_format_ && format != first_format_) {
        fail("FORMAT_ERROR", file_, "a second $MeshFormat differs from the first");
      }
      has_format_ = true;
      first_format_ = format;
      return true;
    }
    if (section == "$Nodes" || section == "$NOD" || section == "$ParametricNodes") {
      once(has_nodes_, section);
      read_msh_nodes(file_, numbers_, section == "$ParametricNodes", content_.nodes);
    } else if (section == "$Elements" || section == "$ELM") {
      once(has_elements_, section);
      read_msh_elements(file_, numbers_, content_);
    } else if (section == "$PhysicalNames") {
      read_msh_names(numbers_, content_);
    } else if (has_entities && (section == "$Entities" || section == "$PartitionedEntities")) {
      read_msh_entities(numbers_, section == "$PartitionedEntities", content_);
    } else if (section == "$Periodic") {
      read_msh_periodic(numbers_, content_);
    } else if (section == "$NodeData" || section == "$ElementData") {
      read_msh_view(numbers_, section == "$NodeData", content_);
    } else {
      return false;
    }
    return true;
  }

  void once(bool& has, std::string_view section) const {
    if (has) scanner_.refuse(std::string(section) + " once", "a second one");
    has = true;
  }

  const path& file_;
  std::string_view text_;
  Scanner scanner_;
  MshNumbers numbers_;
  MshContent content_;
  std::size_t sections_ = 0;
  bool has_format_ = false;
  MshFormat first_format_;
  bool has_nodes_ = false;
  bool has_elements_ = false;
};

}  // namespace

MshContent parse_msh(const path& file, std::string_view text) {
  const std::size_t mark = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
  MshContent content = MshParser(file, text.substr(mark)).parse();
  for (auto& fields : content.nodes.fields) {
    for (CoordinateFields::Field& field : fields) field.begin += mark;
  }
  return content;
}

}  // namespace meshsmooth::formats
