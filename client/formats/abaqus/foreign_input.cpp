#include "foreign_input.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <vector>

#include "deck_reader.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

struct Dialect {
  std::string_view begin;  // of its first line, in capitals
  std::string_view name;
};

// Programs whose files are called .inp, too, and formats that are easily renamed so.
constexpr auto kDialects = std::to_array<Dialect>({
    {"*KEYWORD", "an LS-DYNA deck"},
    {"/BATCH", "a file of ANSYS commands"},
    {"/PREP7", "a file of ANSYS commands"},
    {"/COM", "a file of ANSYS commands"},
    {"/TITLE", "a file of ANSYS commands"},
    {"/CLEAR", "a file of ANSYS commands"},
    {"/FILNAME", "a file of ANSYS commands"},
    {"/NOPR", "a file of ANSYS commands"},
    {"[TITLE]", "a network of EPANET or SWMM"},
    {"[JUNCTIONS]", "a network of EPANET or SWMM"},
    {"[OPTIONS]", "a network of EPANET or SWMM"},
    {"[MESH]", "an input file of MOOSE"},
    {"&CONTROL", "an input file of Quantum ESPRESSO"},
    {"&SYSTEM", "an input file of Quantum ESPRESSO"},
    {"&GLOBAL", "an input file of CP2K"},
    {"&FORCE_EVAL", "an input file of CP2K"},
    {"&HEAD", "an input file of FDS"},
    {"&", "a Fortran namelist"},
    {"$MESHFORMAT", "a mesh of Gmsh, whose extension is .msh"},
    {"$CONTRL", "an input file of GAMESS"},
    {"$SYSTEM", "an input file of GAMESS"},
    {"$BASIS", "an input file of GAMESS"},
    {"$DATA", "an input file of GAMESS"},
    {"ELEMENTS", "a mechanism of CHEMKIN"},
    {"VERSION HTTPS://GIT-LFS", "a pointer of Git LFS, which stands for the file"},
    {"%CHK", "an input file of Gaussian"},
    {"%MEM", "an input file of Gaussian"},
    {"%NPROC", "an input file of Gaussian"},
    {"#P ", "an input file of Gaussian"},
    {"#N ", "an input file of Gaussian"},
    {"#T ", "an input file of Gaussian"},
    {"BEGIN BULK", "a Nastran deck, whose extension is .bdf or .nas"},
    {"CEND", "a Nastran deck, whose extension is .bdf or .nas"},
    {"SOL ", "a Nastran deck, whose extension is .bdf or .nas"},
    {"CMO", "a file of LaGriT commands"},
    {"MESHVERSIONFORMATTED", "a Medit mesh, whose extension is .mesh"},
    {"NDIME", "an SU2 mesh, whose extension is .su2"},
    {"# VTK DATAFILE", "a VTK file, whose extension is .vtk"},
});

/// The first line that is not empty and no comment of the given sign.
std::string_view first_line(std::string_view text, char comment) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    if (!line.empty() && line.front() != comment) return line;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return {};
}

/// "nodes cells node-data cell-data model-data", also as LaGriT has it.
std::optional<std::string> name_ucd(std::string_view text) {
  std::string_view line = first_line(text, '#');
  std::vector<std::string> numbers;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
    const std::string_view word = line.substr(0, end);
    if (word.find_first_not_of("0123456789") != std::string_view::npos) return std::nullopt;
    numbers.emplace_back(word);
    line = trimmed(line.substr(end));
  }
  if (numbers.size() != 5) return std::nullopt;
  return "an AVS UCD file (" + numbers[0] + " nodes, " + numbers[1] +
         " cells), as AVS and LaGriT write it";
}

}  // namespace

bool has_deck_keyword(std::string_view text) {
  static constexpr auto kKeywords = std::to_array<std::string_view>(
      {"NODE", "ELEMENT", "INCLUDE", "HEADING", "PART", "ASSEMBLY", "INSTANCE", "NSET", "ELSET"});
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!line.starts_with('*')) continue;
    const std::string_view word = trimmed(line.substr(1));
    const std::string name = in_capitals(trimmed(word.substr(0, word.find(','))));
    if (std::ranges::find(kKeywords, name) != kKeywords.end()) return true;
  }
  return false;
}

std::optional<std::string> name_foreign_input(std::string_view text) {
  const std::string first = in_capitals(first_line(text, 0));
  const bool is_deck = has_deck_keyword(text);
  if (is_deck && !first.starts_with("*KEYWORD")) return std::nullopt;
  if (auto ucd = name_ucd(text)) return ucd;
  if (first.starts_with('!') && in_capitals(text).find("XYZ") != std::string::npos) {
    return "an input file of ORCA";
  }
  const std::string begin = in_capitals(first_line(text, '!'));  // after comments
  const auto* const found = std::ranges::find_if(
      kDialects, [&](const Dialect& dialect) { return begin.starts_with(dialect.begin); });
  if (found == kDialects.end()) return std::nullopt;
  return std::string(found->name);
}

}  // namespace meshsmooth::formats
